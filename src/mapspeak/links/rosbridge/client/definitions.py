"""What types look like: asked of the robot once, and known to us where it cannot say."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros.definitions import (
    TypeBook,
    find_actions_of_ros1,
    known_definitions,
    name_parts,
    split_definition,
)
from mapspeak.ros.messages import Dialect, bare_type

Call = Callable[[str, Mapping[str, Any]], Awaitable[dict[str, Any]]]
KINDS = ("msg", "srv", "action")


class DefinitionKeeper:
    """Definitions of one robot. What it has said is kept; only what is unknown is asked for again.

    On ROS 2 some of rosapi's services that describe types end or hang it: these are never called
    there, so that services and actions are described by what we know ourselves.

    Args:
        call: Calls one of rosapi's services with its arguments.
    """

    def __init__(self, call: Call) -> None:
        self._call = call
        self._told: dict[str, str] = {}
        self._known: dict[str, str] = {}
        self._not_told: set[str] = set()

    async def fetch(self, type_name: str, *, dialect: Dialect, distro: str) -> Mapping[str, str]:
        """Gives the texts of a type's parts and of all types within, as the port says."""
        bare, kinds = bare_type(type_name), _kinds_of(type_name)
        if not self._known:
            self._known = known_definitions(dialect, distro=distro)
        if not self._find(self._told, bare, kinds) and self._is_worth_asking(bare, kinds):
            await self._ask_graph()
            if dialect is Dialect.ROS1 and not self._find(self._told, bare, kinds):
                await self._ask_details(bare, kinds)
            self._not_told.add(bare)
        names = self._find(self._told, bare, kinds) or self._find(self._known, bare, kinds)
        book = TypeBook({**self._known, **self._told})
        within = [each for name in names for each in book.within(name)]
        return {each: book.texts[each] for each in dict.fromkeys(within)}

    def _is_worth_asking(self, bare: str, kinds: tuple[str, ...]) -> bool:
        """False for what the robot did not say when it was asked, and we know ourselves."""
        return bare not in self._not_told or not self._find(self._known, bare, kinds)

    def _find(self, texts: Mapping[str, str], bare: str, kinds: tuple[str, ...]) -> tuple[str, ...]:
        service, action = name_parts(bare)
        options = {"msg": (bare,), "srv": service, "action": action}
        found = (options[kind] for kind in kinds)
        return next((names for names in found if all(name in texts for name in names)), ())

    async def _ask_graph(self) -> None:
        """Takes the definitions of all types that some topic has."""
        try:
            answer = await self._call("/rosapi/topics_and_raw_types", {})
        except LinkError:
            return  # An early rosapi has no such service; what we know ourselves is left.
        types, texts = answer.get("types"), answer.get("typedefs_full_text")
        if not isinstance(types, list) or not isinstance(texts, list):
            return
        for name, text in zip(types, texts, strict=False):
            if (
                isinstance(name, str)
                and isinstance(text, str)
                and bare_type(name) not in self._told
            ):
                self._told |= split_definition(name, text)
        self._told |= find_actions_of_ros1(self._told)

    async def _ask_details(self, bare: str, kinds: tuple[str, ...]) -> None:
        """Asks for one type, as only the rosapi of ROS 1 survives."""
        service = name_parts(bare)[0]
        questions = {"msg": {"message_details": bare}, "srv": {}}
        if "srv" in kinds:
            questions["srv"] = {
                "service_request_details": service[0],
                "service_response_details": service[1],
            }
        for kind in kinds:
            for question, name in questions.get(kind, {}).items():
                try:
                    answer = await self._call(f"/rosapi/{question}", {"type": bare})
                except LinkError:
                    break
                self._take_details(answer, name)

    def _take_details(self, answer: Mapping[str, Any], name: str) -> None:
        details = answer.get("typedefs")
        entries = details if isinstance(details, list) else []
        for number, entry in enumerate(each for each in entries if isinstance(each, Mapping)):
            own_name = bare_type(str(entry.get("type", "")))
            self._told.setdefault(name if number == 0 else own_name, _write_text(entry))


def _kinds_of(type_name: str) -> tuple[str, ...]:
    parts = type_name.strip("/").split("/")
    return (parts[1],) if len(parts) == 3 and parts[1] in KINDS else KINDS


def _write_text(detail: Mapping[str, Any]) -> str:
    """Gives as a .msg text what rosapi says of one type in lists."""
    names, types, lengths, constants, values = (
        value if isinstance(value := detail.get(key), list) else []
        for key in ("fieldnames", "fieldtypes", "fieldarraylen", "constnames", "constvalues")
    )
    lines = [f"string {name}={value}" for name, value in zip(constants, values, strict=False)]
    for name, type_name, length in zip(names, types, lengths, strict=False):
        shown = "" if length == -1 else f"[{length or ''}]"
        lines.append(f"{type_name}{shown} {name}")
    return "\n".join(lines)
