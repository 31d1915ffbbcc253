"""Type definitions over DDS: described by the robot, or known to us by their hash."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.links.cdr import KnownTypes
from mapspeak.ros.definitions.texts import DISTROS, action_parts, find_parts, known_definitions
from mapspeak.ros.definitions.types import TypeBook, hash_type
from mapspeak.ros.messages.fields import TYPE, Dialect, Message, bare_type

_NODES = (
    "string<=256 node_namespace\nstring<=256 node_name\n"
    "rmw_dds_common/{gid}[] reader_gid_seq\nrmw_dds_common/{gid}[] writer_gid_seq"
)
_TEXTS = {
    "rmw_dds_common/Gid": "uint8[16] data",
    "rmw_dds_common/NodeEntitiesInfo": _NODES.format(gid="Gid"),
    "rmw_dds_common/ParticipantEntitiesInfo": (
        "rmw_dds_common/Gid gid\nrmw_dds_common/NodeEntitiesInfo[] node_entities_info_seq"
    ),
    # Humble has longer ids, under the same names.
    "rmw_dds_common/LongGid": "uint8[24] data",
    "rmw_dds_common/LongNodeEntitiesInfo": _NODES.format(gid="LongGid"),
    "rmw_dds_common/LongParticipantEntitiesInfo": (
        "rmw_dds_common/LongGid gid\nrmw_dds_common/LongNodeEntitiesInfo[] node_entities_info_seq"
    ),
}

_PLAIN_TYPES = {
    2: "int8", 3: "uint8", 4: "int16", 5: "uint16", 6: "int32", 7: "uint32", 8: "int64",
    9: "uint64", 10: "float32", 11: "float64", 13: "char", 15: "bool", 16: "byte", 17: "string",
    18: "wstring", 21: "string", 22: "wstring",
}  # fmt: skip
"""By type_description_interfaces/FieldType, below the step from one kind of list to the next."""
_STEP, _NESTED = 48, 1
_LIMITED = (21, 22)
_ONE, _ARRAY, _BOUNDED, _SEQUENCE = range(4)


@cache
def build_type_book(distro: str = "") -> TypeBook:
    """Return the types that come with mapspeak, and those that DDS needs.

    Args:
        distro: See `known_definitions`.
    """
    texts = {**known_definitions(Dialect.ROS2, distro=distro), **_TEXTS}
    for name in [name for name in texts if name.endswith("_Goal")]:
        texts |= action_parts(name.removesuffix("_Goal"))
    return TypeBook(texts)


def read_type_description(answer: Message) -> dict[str, str]:
    """Return the texts of all types in an answer of type_description_interfaces."""
    if not answer["successful"]:
        raise LinkError(
            f"The robot does not describe a type: {str(answer['failure_reason'])[:200]}",
            hint="Take rosbridge, which reads its types on the robot.",
        )
    description = answer["type_description"]
    described = [description["type_description"], *description["referenced_type_descriptions"]]
    return {bare_type(each["type_name"]): _text_of(each["fields"]) for each in described}


def _text_of(fields: Sequence[Mapping[str, Message]]) -> str:
    lines = [f"{_type_of(each['type'])} {each['name']}" for each in fields]
    return "\n".join(lines)


def _type_of(described: Message) -> str:
    shape, plain = divmod(int(described["type_id"]), _STEP)
    name = str(described["nested_type_name"]) if plain == _NESTED else _PLAIN_TYPES.get(plain)
    if name is None or (plain == _NESTED and not TYPE.fullmatch(name)):
        raise LinkError(
            f"The robot describes a field of the kind {described['type_id']}, unknown to us.",
            hint="Take rosbridge, which reads its types on the robot.",
        )
    if plain in _LIMITED:
        name = f"{name}<={int(described['string_capacity'])}"
    capacity = int(described["capacity"])
    return name + {_ONE: "", _ARRAY: f"[{capacity}]", _BOUNDED: f"[<={capacity}]"}.get(shape, "[]")


HUMBLE = "humble"


class Types(KnownTypes):
    """Encodes and decodes, after the definitions known so far.

    Args:
        distro: Of ROS 2; its definitions count until the robot describes types; see
            `known_definitions`.
    """

    def __init__(self, *, distro: str = "") -> None:
        self._distro = distro
        self._hashes: dict[str, str] = {}
        self._other_versions: set[str] = set()
        super().__init__(build_type_book(distro))

    def encode(self, type_name: str, message: Mapping[str, Any]) -> bytes:
        """Return the bytes of a message."""
        if self._is_other_version(type_name):
            raise self.refusal(type_name)
        return super().encode(type_name, message)

    def knows(self, type_name: str) -> bool:
        """Return True for a type whose fields, and those of all types within, are known."""
        return (
            self._book.knows(type_name)
            and not self._book.missing(type_name)
            and not self._is_other_version(type_name)
        )

    def refusal(self, type_name: str) -> LinkError:
        """Return the error for a type that is not known as the robot has it."""
        if self._is_other_version(type_name):
            return LinkError(
                f"The robot's {type_name} has other fields than those that mapspeak knows (of ROS "
                f"2 {', '.join(distro.capitalize() for distro in sorted(DISTROS))}): "
                "nothing was sent.",
                hint="Sending it again does not help. Take rosbridge or rclpy for this robot: "
                "there its own definitions count.",
            )
        return LinkError(
            f"We do not know what a {type_name} looks like, and DDS does not tell.",
            hint="Nodes of ROS 2 Jazzy and later tell the types of topics, and no others. "
            "Take rosbridge or rclpy for this robot.",
        )

    def _is_other_version(self, type_name: str) -> bool:
        return bare_type(type_name) in self._other_versions

    def take_humble(self) -> None:
        """Take in that the robot runs Humble, whose nodes tell no hashes."""
        if self._distro != HUMBLE:
            self._distro = HUMBLE
            self._use(build_type_book(HUMBLE))

    def take_hash(self, type_name: str, type_hash: str) -> None:
        """Take in the hash of a type on the robot: of the versions we know, the one that has it.

        Args:
            type_name: Of a message, or of a part of a service or an action.
            type_hash: As DDS tells it since ROS 2 Iron; empty before.
        """
        bare = bare_type(type_name)
        if not type_hash or self._hashes.get(bare) == type_hash:
            return
        self._hashes[bare] = type_hash
        versions = (self._book, *map(build_type_book, DISTROS))
        books = [book for book in versions if book.knows(bare)]
        fitting = next((book for book in books if _has_hash(book, bare, type_hash)), None)
        if fitting is None:
            self._other_versions |= {bare} if books else set()
            return
        self._other_versions.discard(bare)
        if fitting is not self._book:
            texts = {name: fitting.texts[name] for name in fitting.within(bare)}
            self._use(TypeBook({**self._book.texts, **texts}))

    def take_description(self, answer: Message) -> None:
        """Take in a node's description of a type."""
        texts = read_type_description(answer)
        self._other_versions -= texts.keys()
        self._use(TypeBook({**self._book.texts, **texts}))

    def definitions(self, type_name: str) -> dict[str, str]:
        """Return the texts of a type and of all within; see `RosConnection.fetch_definitions`."""
        return self._book.texts_of(find_parts(self._book.texts, type_name))


def _has_hash(book: TypeBook, name: str, type_hash: str) -> bool:
    try:
        return hash_type(book, name) == type_hash
    except LinkError:
        return False
