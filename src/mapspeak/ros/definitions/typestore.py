"""Types as rosbags describes them: the source of their hashes and of the code for their CDR."""

from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros.definitions.types import MOST_NESTED, Field, MessageType, TypeBook
from mapspeak.ros.messages.fields import bare_type

NOTHING = Field(name="structure_needs_at_least_one_member", type="uint8")
"""The field that ROS 2 puts in a message without fields."""
OF_ACTION = ("Goal", "Result", "Feedback", "FeedbackMessage")
OF_SERVICE = ("Request", "Response")
OF_ACTIONS_SERVICE = ("SendGoal", "GetResult")


def name_in_ros2(name: str) -> str:
    """Return a type as "package/kind/Type"; the parts of services and actions by their names."""
    package, _, last = bare_type(name).partition("/")
    stem, _, part = last.rpartition("_")
    if part in OF_ACTION or stem.rpartition("_")[2] in OF_ACTIONS_SERVICE:
        return f"{package}/action/{last}"
    return f"{package}/{'srv' if part in OF_SERVICE else 'msg'}/{last}"


def hash_type(book: TypeBook, name: str) -> str:
    """Return a type's hash, as nodes of ROS 2 tell it since Iron: "RIHS01_...".

    Raises:
        LinkError: It or a type within is unknown, contains itself, or cannot be encoded in CDR.
    """
    from rosbags.typesys.store import Typestore  # noqa: PLC0415 - takes 0.1 s

    store = Typestore()
    _add(store.fielddefs, book, name, above=())
    return store.hash_rihs01(name_in_ros2(name))


def _add(found: dict[str, Any], book: TypeBook, name: str, *, above: tuple[str, ...]) -> None:
    message = look_up(book, name, above=above)
    if name_in_ros2(name) in found:
        return
    for kind in dict.fromkeys(field.type for field in message.fields if field.is_message):
        _add(found, book, kind, above=(*above, message.name))
    fields = message.fields or (NOTHING,)
    found[name_in_ros2(name)] = ([], [(field.name, _describe(field)) for field in fields])


def _describe(field: Field) -> Any:  # noqa: ANN401 - rosbags' nested tuples
    if field.is_message:
        return describe_field(field, name_in_ros2(field.type))
    return describe_field(field, "uint8" if field.type == "char" else field.type)


def look_up(book: TypeBook, name: str, *, above: tuple[str, ...]) -> MessageType:
    """Return a type that is within others.

    Raises:
        LinkError: It is not known, or holds itself.
    """
    bare = bare_type(name)
    if not book.knows(name) or bare in above or len(above) > MOST_NESTED:
        raise LinkError(
            f"We do not know what a {bare[:80]} looks like.",
            hint="Robots of ROS 2 Jazzy and later tell it for topics; for others take rosbridge, "
            "or give its definition where a tool asks for one.",
        )
    return book[name]


def describe_field(field: Field, kind: str) -> Any:  # noqa: ANN401 - rosbags' nested tuples
    """Return a field as rosbags describes it; its kind is one of number, or its messages' name.

    Raises:
        LinkError: CDR cannot hold it.
    """
    from rosbags.interfaces import Nodetype  # noqa: PLC0415 - as above

    if field.type == "wstring":
        raise LinkError(
            f"The field {field.name[:80]} holds a wstring, which mapspeak has no CDR for.",
            hint="Take rosbridge for it.",
        )
    is_name = field.is_message
    one: Any = (
        (Nodetype.NAME, kind) if is_name else (Nodetype.BASE, (kind, field.most_letters or 0))
    )
    if field.length is None:
        return one
    if field.length:
        return (Nodetype.ARRAY, (one, field.length))
    return (Nodetype.SEQUENCE, (one, field.most or 0))
