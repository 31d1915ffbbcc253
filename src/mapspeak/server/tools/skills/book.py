"""All skills of one server by their names: built in, the robot's own, its owner's, missions."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from mapspeak.errors import ConfigError, MapspeakError, SkillError
from mapspeak.memory.episodes.store import memory_folder
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import full_name
from mapspeak.server.tools.skills.board import SkillBoard
from mapspeak.server.tools.skills.facts import SessionFacts
from mapspeak.server.tools.skills.interfaces import Interface, InterfaceKind, open_interface
from mapspeak.server.tools.skills.leaves import DriveSkill, LookSkill, NoteSkill
from mapspeak.session import Session
from mapspeak.skill import Skill
from mapspeak.skills.guarded import GuardedSkill
from mapspeak.skills.missions.conditions import CheckSkill, WaitForSkill, WaitSkill
from mapspeak.skills.missions.mission import MissionDesk, MissionSkill
from mapspeak.skills.missions.questions import AskSkill, QuestionBook
from mapspeak.skills.missions.reading import CONTROL
from mapspeak.skills.missions.record import Interrupted, MissionRecord
from mapspeak.skills.missions.tree import MissionPlan
from mapspeak.skills.owners.owned import OwnedSkill
from mapspeak.skills.owners.skillsfile import Called, OwnersEntry, load_skills

INTERFACES = {
    Called.SERVICE: InterfaceKind.SERVICE,
    Called.ACTION: InterfaceKind.ACTION,
    Called.PUBLISH: InterfaceKind.PUBLISH,
    Called.READ: InterfaceKind.READ,
}

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SavedMission:
    """A mission that was saved, and the file that it is in."""

    path: Path
    plan: MissionPlan


class SkillBook:
    """Knows every skill, and keeps saved missions as files.

    Args:
        session: Whose robot it is.
        ros: The way to its interfaces.
        entries: Of the owner's skills.yaml.

    Attributes:
        questions: Those that missions ask.
        folder: Where missions are saved.
        interrupted: Missions that an earlier server did not live to end.
    """

    def __init__(
        self, session: Session, ros: RosAccess, entries: Sequence[OwnersEntry] = ()
    ) -> None:
        self._session = session
        self._ros = ros
        self._board: SkillBoard | None = None
        self.questions = QuestionBook()
        self.facts = SessionFacts(session, ros)
        self.folder = memory_folder(session.memory.path) / "missions"
        record = MissionRecord(self.folder / "record.jsonl", wall_clock=session.find_wall_time)
        self.desk = MissionDesk(
            find_skill=self.find,
            list_skills=lambda: sorted(self.skills),
            facts=self.facts,
            guard=session.guard,
            record=record,
            present=session.client_is_heard,
        )
        self.interrupted: tuple[Interrupted, ...] = record.take_interrupted()
        for each in self.interrupted:
            logger.warning("The mission %s was interrupted: its server ended.", each.name)
        built_in = (
            *(DriveSkill(session), LookSkill(session, self.questions), NoteSkill(session)),
            *(CheckSkill(self.facts), WaitForSkill(self.facts), WaitSkill(self.facts)),
            AskSkill(self.questions, self.facts),
        )
        self._built_in = {each.spec.name: self._guard(each, is_own=True) for each in built_in}
        own = () if session.skilled is None else session.skilled.skills
        self._own: dict[str, Skill] = {each.spec.name: self._guard(each) for each in own}
        self._owned = {each.spec.name: self._open(each) for each in entries}
        self._saved: dict[str, SavedMission] = {}
        self._check_names(entries)
        self.load_saved()

    @property
    def skills(self) -> Mapping[str, Skill]:
        """All that a mission can use, with the interfaces that are exposed now."""
        exposed = {} if self._board is None else self._board.skills
        saved = {name: self.plan(each.plan) for name, each in self._saved.items()}
        return {**exposed, **self._own, **self._owned, **saved, **self._built_in}

    @property
    def saved(self) -> Mapping[str, SavedMission]:
        """The missions that were saved, by name."""
        return self._saved

    def find(self, name: str) -> Skill:
        """Return a skill by its name.

        Raises:
            SkillError: There is none of that name now.
        """
        found = self.skills.get(name)
        if found is None:
            raise SkillError(f"There is no skill {name[:60]!r}.", hint="The list of skills tells.")
        return found

    def put_up(self, board: SkillBoard) -> None:
        """Offer the robot's own skills, the owner's and the saved missions as tools."""
        self._board = board
        for skill in (*self._own.values(), *self._owned.values()):
            board.put_up(skill)
        for name in self._saved:
            board.put_up(self.find(name))

    def load_saved(self) -> None:
        """Read the saved missions anew; people may have edited the files."""
        found: dict[str, SavedMission] = {}
        for path in sorted(self.folder.glob("*.yaml")):
            try:
                entries = load_skills(path)
            except ConfigError as error:
                logger.warning("%s", error)
                continue
            for each in entries:
                if (plan := _plan_of(each)) is not None:
                    found[each.spec.name] = SavedMission(path, plan)
        before, self._saved = self._saved, found
        if self._board is not None:
            for name in before.keys() - found.keys():
                self._board.take_down(name)
            for name, saved in found.items():
                if before.get(name) != saved:
                    self._board.put_up(self.plan(saved.plan))

    def check_free(self, name: str) -> None:
        """Return when a mission may be saved under a name.

        Raises:
            SkillError: Another skill, or a word of the language of missions, has it.
        """
        taken = {*self._built_in, *self._own, *self._owned, *CONTROL}
        tools = () if self._board is None else self._board.taken_names
        if name in taken or (name in tools and name not in self._saved):
            raise SkillError(f"{name!r} is taken.", hint="Choose another name.")

    def plan(self, plan: MissionPlan) -> MissionSkill:
        """Return a mission as a skill."""
        return MissionSkill(plan, self.desk)

    def _guard(self, skill: Skill, *, is_own: bool = False) -> Skill:
        guard = self._session.guard
        return GuardedSkill(skill, facts=self.facts, guard=guard, is_through_guard=is_own)

    def _open(self, entry: OwnersEntry) -> Skill:
        if (plan := _plan_of(entry)) is not None:
            return self.plan(plan)
        is_ros = entry.calls is not Called.ROBOT_SKILL
        owned = OwnedSkill(entry, partial(self._find_called, entry), self.find)
        return self._guard(owned, is_own=is_ros)

    async def _find_called(self, entry: OwnersEntry) -> Skill:
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
        match entry.calls:
            case Called.SERVICE:
                kind = entry.type or await inquiry.fetch_service_type(name)
            case Called.ACTION:
                kind = entry.type or await inquiry.fetch_action_type(name)
            case _:
                kind = entry.type or await inquiry.fetch_topic_type(name)
        interface = Interface(INTERFACES[entry.calls], name, kind)
        return await open_interface(interface, self._ros, name=entry.spec.name)

    async def check_entry(self, entry: OwnersEntry) -> str:
        """Return the fault of a skill of skills.yaml at this robot; empty without one."""
        try:
            if (plan := _plan_of(entry)) is not None:
                self.desk.check(plan)
                return ""
            called = await self._find_called(entry)
        except MapspeakError as error:
            return str(error)
        takes = {each.name for each in called.spec.parameters}
        strangers = {*entry.fixed, *entry.renamed.values()} - takes
        if strangers:
            has = ", ".join(sorted(takes)) or "nothing"
            return f"{entry.target} takes no {', '.join(sorted(strangers))}. It takes {has}."
        return ""

    def _check_names(self, entries: Sequence[OwnersEntry]) -> None:
        for each in entries:
            if each.spec.name in (*self._built_in, *CONTROL):
                raise ConfigError(
                    f"skills.yaml: {each.spec.name!r} is a word of missions.",
                    hint="Rename the skill.",
                )


def _plan_of(entry: OwnersEntry) -> MissionPlan | None:
    """Return the mission that a skill of a file is; None for any other."""
    if entry.tree is None:
        return None
    return MissionPlan(spec=entry.spec, tree=entry.tree, remember=entry.remember)
