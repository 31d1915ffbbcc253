"""All skills of one server by their names: built in, the robot's own, its owner's, missions."""

import logging
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from functools import partial

from mapspeak.errors import ConfigError, MapspeakError, SkillError, say_nearest
from mapspeak.memory.episodes.store import memory_folder
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import full_name
from mapspeak.server.tools.skills.board import SkillBoard
from mapspeak.server.tools.skills.interfaces import Interface, open_interface
from mapspeak.server.tools.skills.leaves import Leaves, SessionFacts
from mapspeak.session import Session
from mapspeak.skill import Skill
from mapspeak.skills.guarding import SkillGate
from mapspeak.skills.mission import MissionDesk
from mapspeak.skills.missionrecord import MissionRecord
from mapspeak.skills.runs import QuestionBook
from mapspeak.skills.skillsfile import Called, OwnersEntry, load_skills
from mapspeak.skills.steps import CONTROL, Mission

logger = logging.getLogger(__name__)


class SkillBook:
    """Knows every skill, and keeps saved missions as files.

    Args:
        session: Whose robot it is.
        ros: The way to its interfaces.
        entries: Of the owner's skills.yaml.

    Attributes:
        session: The same.
        questions: Those that missions ask.
        desk: Runs missions.
        folder: Where missions are saved.
        saved: The missions that were saved, by name.
        interrupted: Missions that an earlier server did not live to end.
    """

    def __init__(
        self, session: Session, ros: RosAccess, entries: Sequence[OwnersEntry] = ()
    ) -> None:
        self._ros, self.session = ros, session
        self._board: SkillBoard | None = None
        self.questions = QuestionBook()
        self.folder = memory_folder(session.memory.path) / "missions"
        record = MissionRecord(self.folder / "record.jsonl", wall_clock=session.find_wall_time)
        self.interrupted = record.take_interrupted()
        for each in self.interrupted:
            logger.warning("The mission %s was interrupted: its server ended.", each.name)
        facts = SessionFacts(session, ros)
        self._gate = SkillGate(facts, session.guard)
        present, begins = session.client_is_heard, self.questions.forget_pictures
        self.desk = MissionDesk(self.find, self._gate, record, present, begins)
        leaves = Leaves(session, facts, self.questions).list_skills()
        self._built_in = _by_name(self._gate.hold(each, is_through_guard=True) for each in leaves)
        own = () if session.skilled is None else session.skilled.build_skills(session.robot)
        self._own = _by_name(self._gate.hold(each) for each in own)
        for entry in entries:
            if entry.name in (*self._built_in, *CONTROL):
                raise ConfigError(
                    f"skills.yaml: {entry.name!r} is a word of missions.", hint="Rename the skill."
                )
        self._owned = _by_name(self._open(each) for each in entries)
        self.saved: dict[str, Mission] = {}
        self.load_saved()

    @property
    def skills(self) -> Mapping[str, Skill]:
        """All that a mission can use, with the interfaces that are exposed now."""
        exposed = {} if self._board is None else self._board.skills
        return {**exposed, **self._own, **self._owned, **self.saved, **self._built_in}

    def find(self, name: str) -> Skill:
        """Return a skill by its name.

        Raises:
            SkillError: There is none of that name now.
        """
        found = self.skills.get(name)
        if found is None:
            hint = say_nearest(name, self.skills).rstrip()
            hint = hint or f"There are: {', '.join(self.skills)}."
            raise SkillError(f"There is no skill {name[:60]!r}.", hint=hint)
        return found

    def put_up(self, board: SkillBoard) -> None:
        """Offer the robot's own skills, the owner's and the saved missions as tools.

        Raises:
            ConfigError: An owner's skill is called as a tool.
        """
        self._board = board
        for skill in self._owned.values():
            try:
                board.put_up(skill)
            except SkillError as error:
                raise ConfigError(f"skills.yaml: {error.message}", hint=error.hint) from error
        for skill in (*self._own.values(), *self.saved.values()):
            self._offer(skill)
        # No client has seen others.
        board.is_changed = False

    def _offer(self, skill: Skill) -> None:
        """Offer a skill as a tool once there is a board; one that is called as a tool is none."""
        if self._board is None:
            return
        try:
            self._board.put_up(skill)
        except SkillError as error:
            logger.warning("%s", error)

    def load_saved(self) -> None:
        """Read the saved missions anew; people may have edited the files.

        One that is called as another skill or tool takes no place of it.
        """
        saved: dict[str, Mission] = {}
        for path in sorted(self.folder.glob("*.yaml")):
            try:
                entries = load_skills(path)
            except ConfigError as error:
                logger.warning("%s", error)
                continue
            for each in (entry for entry in entries if entry.calls is Called.MISSION):
                try:
                    self.check_free(each.name)
                except SkillError as error:
                    logger.warning("%s: %s", path, error)
                    continue
                saved[each.name] = self.desk.open(each, path)
        before, self.saved = self.saved, saved
        if self._board is not None:
            for name in before.keys() - self.saved.keys():
                self._board.take_down(name)
        for mission in self.saved.values():
            self._offer(mission)

    def check_free(self, name: str) -> None:
        """Return when a mission may be saved under a name.

        Raises:
            SkillError: Another skill, or a word of the language of missions, has it.
        """
        taken = {*self._built_in, *self._own, *self._owned, *CONTROL}
        tools = () if self._board is None else self._board.taken_names
        if name in taken or (name in tools and name not in self.saved):
            raise SkillError(f"{name!r} is taken.", hint="Choose another name.")

    def _open(self, entry: OwnersEntry) -> Skill:
        """Return a skill of a file, held to the policy."""
        if entry.calls is Called.MISSION:
            return self.desk.open(entry)
        run = partial(entry.run, partial(self.open_called, entry), self.find)
        is_ros = entry.calls is not Called.ROBOT_SKILL
        return self._gate.hold(Skill(entry.spec, run), is_through_guard=is_ros)

    async def open_called(self, entry: OwnersEntry) -> Skill:
        """Return the interface that a skill of skills.yaml calls, as the robot offers it now.

        Raises:
            MapspeakError: The robot does not offer it.
        """
        if entry.calls is Called.ROBOT_SKILL:
            own = self._own.get(entry.target)
            if own is None:
                raise SkillError(
                    f"The robot has no skill {entry.target!r}.",
                    hint=f"It has: {', '.join(self._own) or 'none'}.",
                )
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
        return await open_interface(interface, self._ros, name=entry.name, timeout_s=timeout_s)

    async def check_entry(self, entry: OwnersEntry) -> str:
        """Return the fault of a skill of skills.yaml at this robot; empty without one."""
        try:
            if entry.calls is Called.MISSION:
                self.desk.check(self.desk.open(entry))
                return ""
            called = await self.open_called(entry)
        except MapspeakError as error:
            return str(error)
        takes = {each.name for each in called.spec.parameters}
        if strangers := {*entry.fixed, *entry.sets.values()} - takes:
            has = ", ".join(sorted(takes)) or "nothing"
            return f"{entry.target} takes no {', '.join(sorted(strangers))}. It takes {has}."
        return ""


def _by_name(skills: Iterable[Skill]) -> dict[str, Skill]:
    return {each.spec.name: each for each in skills}
