"""All skills of one server by their names: built in, the robot's own, its owner's, missions."""

import logging
from collections.abc import Awaitable, Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any

from mcp_types import Tool as ListedTool
from mcp_types import ToolAnnotations

from mapspeak.errors import ConfigError, MapspeakError, SkillError, say_nearest
from mapspeak.memory.episodes.store import memory_folder
from mapspeak.memory.quoting import quote
from mapspeak.server.text.skills import describe_skill
from mapspeak.server.tools.caller import LONGEST_WAIT_S
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import full_name
from mapspeak.server.tools.skills.interfaces import Interface, open_interface
from mapspeak.server.tools.skills.leaves import Leaves
from mapspeak.session import Session
from mapspeak.skill import Skill, SkillEffect, parameter
from mapspeak.skills.arguments import schema_of
from mapspeak.skills.guarding import SkillGate
from mapspeak.skills.missions import MissionDesk, MissionRecord
from mapspeak.skills.runs import SkillRuns
from mapspeak.skills.skillsfile import Called, OwnersEntry, load_skills
from mapspeak.skills.steps import CONTROL, Mission

WAIT = "wait_s"
WAITS = parameter(
    "number", unit="s to wait for its end", minimum=0.0, maximum=LONGEST_WAIT_S, default=10.0
)
"""What the tool of a skill takes that may last longer than a call."""
MOST_TITLE = 60
logger = logging.getLogger(__name__)


class SkillBook:
    """Knows every skill, keeps saved missions as files, and tells which skills are tools.

    Args:
        entries: Of the owner's skills.yaml; ConfigError for one that is a word of missions.

    Attributes:
        folder: Where missions are saved.
        saved: The missions that were saved, by name.
        exposed: The interfaces of the robot that are tools now, by the names of these.
        interrupted: Missions that an earlier server did not live to end.
    """

    def __init__(
        self, session: Session, ros: RosAccess, entries: Sequence[OwnersEntry] = ()
    ) -> None:
        self._ros, self.session = ros, session
        self.runs = SkillRuns(partial(_count_stops, session), lambda: session.robot.now_s)
        self._tools: Collection[str] = ()
        self._are_tools = self._is_read_only = False
        self._listed: dict[Skill, ListedTool] = {}
        self.folder = memory_folder(session.memory.path) / "missions"
        record = MissionRecord(self.folder / "record.jsonl", wall_clock=session.find_wall_time)
        self.interrupted = record.take_interrupted()
        for each in self.interrupted:
            logger.warning("The mission %s was interrupted: its server ended.", each.name)
        leaves = Leaves(session, ros, self.runs.questions)
        self._gate = gate = SkillGate(leaves, session.guard)
        present, begins = session.client_is_heard, self.runs.questions.pictures.clear
        self.desk = MissionDesk(self.find, gate, record, present, begins)
        own = () if session.skilled is None else session.skilled.build_skills(session.robot)
        built_in = (gate.hold(each, is_through_guard=True) for each in leaves.list_skills())
        self._built_in = {each.spec.name: each for each in built_in}
        self._own = {each.spec.name: gate.hold(each) for each in own}
        self._owned: dict[str, Skill] = {}
        self.exposed: dict[str, Skill] = {}
        self.saved: dict[str, Mission] = {}
        for entry in entries:
            if entry.name in (*self._built_in, *CONTROL):
                said = f"skills.yaml: {entry.name!r} is a word of missions."
                raise ConfigError(said, hint="Rename the skill.")
            self._owned[entry.name] = self._open(entry)
        self.load_saved()

    @property
    def skills(self) -> Mapping[str, Skill]:
        """All that a mission can use, with the interfaces that are exposed now."""
        return {**self.exposed, **self._own, **self._owned, **self.saved, **self._built_in}

    @property
    def offered(self) -> Mapping[str, Skill]:
        """Those that are tools of their own."""
        theirs = {**self._own, **self._owned, **self.saved} if self._are_tools else {}
        return {
            name: each
            for name, each in {**theirs, **self.exposed}.items()
            if name not in self._tools
            and (each.spec.effect is SkillEffect.READS or not self._is_read_only)
        }

    @property
    def taken_names(self) -> set[str]:
        """The names of all tools and skills, and the words of missions."""
        return {*CONTROL, *self._tools, *self.skills}

    def find(self, name: str) -> Skill:
        """Return a skill by its name; SkillError where there is none now."""
        if (found := self.skills.get(name)) is None:
            hint = say_nearest(name, self.skills).rstrip()
            hint = hint or f"There are: {', '.join(self.skills)}."
            raise SkillError(f"There is no skill {name[:60]!r}.", hint=hint)
        return found

    def offer(self, *, beside: Collection[str], is_read_only: bool) -> None:
        """Offer the robot's own skills, the owner's and the saved missions as tools.

        `beside` are the names of other tools: a skill of such a name is no tool, and an owner's
        raises ConfigError. Only skills that read are tools where all `is_read_only`.
        """
        self._tools, self._is_read_only, self._are_tools = beside, is_read_only, True
        for name in (each for each in (*self._owned, *self._own) if each in beside):
            said = f"{name!r} is a tool, and no skill's name."
            if name in self._owned:
                raise ConfigError(f"skills.yaml: {said}", hint="Rename it.")
            logger.warning("%s", said)
        self.load_saved()

    def list_tools(self) -> list[ListedTool]:
        """Return the offered skills as clients are told of them."""
        skills = self.offered.values()
        self._listed = {each: self._listed.get(each) or list_skill(each) for each in skills}
        return list(self._listed.values())

    def load_saved(self) -> None:
        """Read the saved missions anew, for people may have edited the files.

        One that is called as another skill or tool takes no place of it.
        """
        self.saved = {}
        for path in sorted(self.folder.glob("*.yaml")):
            try:
                entries = load_skills(path)
            except ConfigError as error:
                logger.warning("%s", error)
                continue
            for each in (entry for entry in entries if entry.calls is Called.MISSION):
                try:
                    self.check_free(each.name)
                    self.saved[each.name] = self.desk.open(each, path)
                except SkillError as error:
                    logger.warning("%s: %s", path, error)

    def check_free(self, name: str) -> None:
        """Raise SkillError where a tool, a skill or a word of missions has a mission's name."""
        if name in self.taken_names - self.saved.keys():
            raise SkillError(f"{name!r} is taken.", hint="Choose another name.")

    def _open(self, entry: OwnersEntry) -> Skill:
        """Return a skill of a file, held to the policy."""
        if entry.calls is Called.MISSION:
            return self.desk.open(entry)
        run = partial(entry.run, partial(self.open_called, entry), self.find)
        is_ros = entry.calls is not Called.ROBOT_SKILL
        return self._gate.hold(Skill(entry.spec, run), is_through_guard=is_ros)

    async def open_called(self, entry: OwnersEntry) -> Skill:
        """Return what a skill of skills.yaml calls; MapspeakError where that is not offered now."""
        if entry.calls is Called.ROBOT_SKILL:
            if (own := self._own.get(entry.target)) is None:
                hint = f"It has: {', '.join(self._own) or 'none'}."
                raise SkillError(f"The robot has no skill {entry.target!r}.", hint=hint)
            return own
        name, inquiry = full_name(entry.target), self._ros.inquiry
        fetches: dict[Called, Callable[[str], Awaitable[str]]] = {
            Called.SERVICE: inquiry.fetch_service_type,
            Called.ACTION: inquiry.fetch_action_type,
        }
        type_name = entry.type or await fetches.get(entry.calls, inquiry.fetch_topic_type)(name)
        if entry.definition and not await inquiry.connection.fetch_definitions(type_name):
            await inquiry.teach(type_name, entry.definition)
        interface = Interface(entry.calls, name, type_name)
        timeout_s = entry.timeout_s if "timeout_s" in entry.model_fields_set else None
        return await self.open_interface(interface, name=entry.name, timeout_s=timeout_s)

    async def open_interface(self, interface: Interface, **known: Any) -> Skill:  # noqa: ANN401
        """Return an interface of the robot as a skill; each command of it passes the guard."""
        skill = await open_interface(interface, self._ros, **known)
        return self._gate.hold(skill, is_through_guard=True)

    async def check_entry(self, entry: OwnersEntry) -> str:
        """Return the fault of a skill of skills.yaml at this robot; empty without one."""
        try:
            if entry.calls is Called.MISSION:
                self.desk.check(self.desk.open(entry))
                return ""
            takes = (await self.open_called(entry)).spec.parameters
        except MapspeakError as error:
            return str(error)
        if strangers := {*entry.fixed, *entry.sets.values()} - takes.keys():
            has = ", ".join(sorted(takes)) or "nothing"
            return f"{entry.target} takes no {', '.join(sorted(strangers))}. It takes {has}."
        return ""


def _count_stops(session: Session) -> int:
    """Return a number that changes when the robot is stopped or held."""
    is_held = session.guard is not None and session.guard.hold.read() is not None
    return 2 * session.drives.n_stops + is_held


def list_skill(skill: Skill) -> ListedTool:
    """Return a skill as clients are told of it."""
    spec = skill.spec
    reads = spec.effect is SkillEffect.READS
    acts = ToolAnnotations(open_world_hint=False)
    return ListedTool(
        name=spec.name,
        title=quote(spec.description or spec.name, most=MOST_TITLE).strip('"'),
        description=describe_skill(skill),
        input_schema=schema_of({**spec.parameters, **({WAIT: WAITS} if is_long(skill) else {})}),
        annotations=ToolAnnotations(read_only_hint=True) if reads else acts,
    )


def is_long(skill: Skill) -> bool:
    """Return True for a skill that may last longer than one call of a tool."""
    return skill.spec.timeout_s > LONGEST_WAIT_S
