"""Types as rosbags keeps them: what their hashes are made of, and the code that reads their CDR."""

from typing import TYPE_CHECKING, Any

from mapspeak.errors import LinkError
from mapspeak.ros.definitions.book import MOST_NESTED, TypeBook
from mapspeak.ros.definitions.parsing import Field, MessageType
from mapspeak.ros.messages import bare_type

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

__all__ = ["EMPTY", "build_typestore", "hash_type", "name_in_ros2"]

EMPTY = "structure_needs_at_least_one_member"
"""The field of a message without fields."""
OF_ACTION = ("Goal", "Result", "Feedback", "FeedbackMessage")
OF_SERVICE = ("Request", "Response")
OF_ACTIONS_SERVICE = ("SendGoal", "GetResult")
SAME_ON_THE_WIRE = {"char": "uint8"}


def name_in_ros2(name: str) -> str:
    """Gives a type as "package/kind/Type"; the parts of services and actions by their names."""
    package, _, last = bare_type(name).partition("/")
    stem, _, part = last.rpartition("_")
    if part in OF_ACTION or stem.rpartition("_")[2] in OF_ACTIONS_SERVICE:
        return f"{package}/action/{last}"
    return f"{package}/{'srv' if part in OF_SERVICE else 'msg'}/{last}"


def hash_type(book: TypeBook, name: str) -> str:
    """Gives a type's hash, as nodes of ROS 2 tell it since Iron: "RIHS01_...".

    Raises:
        LinkError: See `build_typestore`.
    """
    return build_typestore(book, name).hash_rihs01(name_in_ros2(name))


def build_typestore(book: TypeBook, name: str) -> "Typestore":
    """Gives a store of rosbags that holds a type and all types within.

    Raises:
        LinkError: One of them is not known, holds itself, or holds what CDR cannot.
    """
    from rosbags.typesys.store import Typestore  # noqa: PLC0415 - takes 0.1 s

    store = Typestore()
    _add(store.fielddefs, book, name, depth=0)
    return store


def _add(found: dict[str, Any], book: TypeBook, name: str, *, depth: int) -> None:
    if not book.knows(name) or depth > MOST_NESTED:
        raise LinkError(
            f"We do not know what a {name[:80]} looks like.",
            hint="Robots of ROS 2 Jazzy and later tell it for topics; for others take rosbridge, "
            "or give its definition where a tool asks for one.",
        )
    message = book[name]
    found[name_in_ros2(name)] = ([], _describe_fields(message))
    for kind in dict.fromkeys(field.type for field in message.fields if field.is_message):
        _add(found, book, kind, depth=depth + 1)


def _describe_fields(message: MessageType) -> list[Any]:
    fields = message.fields or (Field(name=EMPTY, type="uint8"),)
    return [(field.name, _describe_field(field)) for field in fields]


def _describe_field(field: Field) -> Any:  # noqa: ANN401 - rosbags' nested tuples
    from rosbags.interfaces import Nodetype  # noqa: PLC0415 - as above

    one: Any
    if field.type == "wstring":
        raise LinkError(
            f"The field {field.name} holds a wstring, which mapspeak cannot write over DDS.",
            hint="Take rosbridge or rclpy for it.",
        )
    if field.is_message:
        one = (Nodetype.NAME, name_in_ros2(field.type))
    else:
        one = (
            Nodetype.BASE,
            (SAME_ON_THE_WIRE.get(field.type, field.type), field.most_letters or 0),
        )
    if field.length is None:
        return one
    if field.length:
        return (Nodetype.ARRAY, (one, field.length))
    return (Nodetype.SEQUENCE, (one, field.most or 0))
