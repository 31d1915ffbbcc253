"""Interfaces of a robot as tools: found when it offers them, withdrawn when it does not."""

import fnmatch
import logging
import math
import re
from collections.abc import Awaitable, Callable, Collection
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, field

import anyio

from mapspeak.errors import LinkError, MapspeakError, PolicyError
from mapspeak.ros.census import fetch_publishers, fetch_subscribers
from mapspeak.ros.messages.fields import bare_type
from mapspeak.safety import GuardedConnection
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import actions_of
from mapspeak.server.tools.ros.services import find_folded
from mapspeak.server.tools.skills.book import SkillBook
from mapspeak.server.tools.skills.interfaces import Interface
from mapspeak.skill import Skill
from mapspeak.skills.skillsfile import Called

MOST_EXPOSED = 100
"""Tools; a model that reads more of them reads nothing else."""
EVERY_S, KEPT_S = 2.0, 20.0
PARTS_OF_ACTION = ("goal", "cancel", "status", "feedback", "result")
MOST_NAME = 60
RESERVED = frozenset({"wait_s", "for_s", "robot"})
"""Names that no argument of a tool may have: they are the tool's own."""
PREFIXES = {Called.PUBLISH: "publish_", Called.READ: "read_"}

logger = logging.getLogger(__name__)


@dataclass(eq=False)
class Exposure:
    """Keeps the exposed skills of a book in step with the robot's interfaces of some names.

    Attributes:
        patterns: Of full names, as the shell writes them: "/gripper/*".
        tell: Tells clients where tools have changed.
        every_s: Between two looks, in wall time.
        kept_s: For which a type, the ends of a topic, or one that failed, are not tried again.
    """

    ros: RosAccess
    book: SkillBook
    patterns: tuple[str, ...]
    _: KW_ONLY
    tell: Callable[[], Awaitable[None]]
    every_s: float = EVERY_S
    kept_s: float = KEPT_S
    _asked_s: float = -math.inf
    _found: dict[tuple[Called, str], list[Interface]] = field(default_factory=dict)
    _opened: dict[Interface, Skill | None] = field(default_factory=dict)

    async def keep_looking(self) -> None:
        """Look again and again; a robot out of reach keeps its tools until it is back.

        One that was never there has none yet.
        """
        while True:
            with suppress(MapspeakError):
                if self.ros.inquiry.connection.lost_for_s is not None:
                    self.forget()
                await self.look()
            await anyio.sleep(self.every_s)

    def forget(self) -> None:
        """Ask for everything anew with the next look: the robot may be another one."""
        self._asked_s = -math.inf

    async def look(self) -> None:
        """Expose new interfaces, withdraw those that are gone, and tell clients of any change.

        LinkError where the robot cannot be asked.
        """
        named, now_s = await self._list_named(), anyio.current_time()
        if is_due := now_s >= self._asked_s + self.kept_s:
            self._asked_s = now_s
        asked, self._found = self._found, {key: self._found.get(key, []) for key in named}
        for key, type_name in named.items():
            if is_due or key not in asked:
                # At an error all stays.
                with suppress(LinkError):
                    self._found[key] = await self._fetch(*key, type_name)
        found = (interface for several in self._found.values() for interface in several)
        opened = {each: self._opened.get(each) for each in found}
        self.book.exposed = {each.spec.name: each for each in opened.values() if each is not None}
        for interface, skill in opened.items():
            if skill is None and (is_due or interface not in self._opened):
                opened[interface] = await self._open(interface)
        self._opened = opened
        await self.tell()

    async def _open(self, interface: Interface) -> Skill | None:
        """Return an interface as a skill; None where it cannot be, which is told once."""
        base = f"{PREFIXES.get(interface.kind, '')}{interface.name.strip('/')}"
        name = _name_tool(base, taken=self.book.taken_names)
        ros, command = self.ros.inquiry.connection, interface.command
        try:
            if len(self.book.exposed) >= MOST_EXPOSED:
                said = f"{MOST_EXPOSED} tools are exposed already."
                raise LinkError(said, hint="Name fewer of them.")
            if isinstance(ros, GuardedConnection) and command and ros.is_name_denied(command):
                said = "The policy denies it."
                raise PolicyError(said, hint="A person can allow it in policy.yaml.")
            skill = await self.book.open_interface(interface, name=name, reserved=RESERVED)
        except MapspeakError as error:
            if interface not in self._opened:
                logger.warning("%s is not exposed: %s", interface.name, error)
            return None
        self.book.exposed[name] = skill
        return skill

    async def _list_named(self) -> dict[tuple[Called, str], str]:
        """Return what the robot offers now of the requested names, with the types of topics."""
        connection = self.ros.inquiry.connection
        graph, offered = await connection.fetch_graph(), await connection.fetch_services()
        actions = actions_of(graph)
        parts = {f"{action}/{part}" for action in actions for part in PARTS_OF_ACTION}
        topics = (each for each in sorted(graph.types) if "/_action/" not in each)
        services = (each for each in offered if find_folded(each) is None)
        types = {
            **{(Called.ACTION, name): "" for name in actions},
            **{(Called.SERVICE, name): "" for name in services if "/_action/" not in name},
            **{(Called.SERVICE, name): "" for name in offered if name in self.patterns},
            **{(Called.READ, name): graph.types[name] for name in topics if name not in parts},
        }
        return {
            key: kind
            for key, kind in types.items()
            if any(fnmatch.fnmatchcase(key[1], pattern) for pattern in self.patterns)
        }

    async def _fetch(self, called: Called, name: str, kind: str) -> list[Interface]:
        """Return an action or a service; or what a topic of a type is for, by its ends."""
        inquiry = self.ros.inquiry
        if called is Called.READ:
            ends = {
                Called.READ: await fetch_publishers(inquiry.connection, name),
                Called.PUBLISH: await fetch_subscribers(inquiry.connection, name),
            }
            return [Interface(side, name, bare_type(kind)) for side in ends if ends[side].others]
        fetch = inquiry.fetch_action_type if called is Called.ACTION else inquiry.fetch_service_type
        return [Interface(called, name, bare_type(await fetch(name)))]


def _name_tool(name: str, *, taken: Collection[str]) -> str:
    """Return what a name of ROS is called as a tool, like no other tool."""
    base = re.sub(r"\W+", "_", name, flags=re.ASCII).lower()[-MOST_NAME:].strip("_") or "skill"
    others = (f"robot_{base}{end}" for end in ("", *(f"_{n}" for n in range(2, 1000))))
    return next(each for each in (base, *others) if each not in taken)
