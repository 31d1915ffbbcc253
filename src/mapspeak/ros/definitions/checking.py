"""A type in words, and the check of outgoing messages against their type."""

import base64
import difflib
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.ros.definitions.types import (
    FLOATS,
    MOST_NESTED,
    TEXTS,
    WHOLES,
    Field,
    MessageType,
    TypeBook,
)

MOST_INLINE = 4
MOST_CONSTANTS = 40
INDENT = "  "


def describe_type(book: TypeBook, name: str) -> list[str]:
    """Return a line for each field, indented by its depth; a type is spelled out once."""
    return list(_describe(book, book[name], depth=0, told=set()))


def _describe(book: TypeBook, message: MessageType, *, depth: int, told: set[str]) -> Iterator[str]:
    for field in message.fields:
        head = f"{INDENT * depth}{_say_field(field)}"
        if not field.is_message:
            yield head
        elif not book.knows(field.type):
            yield f"{head} (not described)"
        elif _is_short(book[field.type]):
            yield f"{head} {{{', '.join(map(_say_field, book[field.type].fields))}}}"
        elif field.type in told or depth > MOST_NESTED:
            yield f"{head} (as above)"
        else:
            told.add(field.type)
            yield head
            yield from _describe(book, book[field.type], depth=depth + 1, told=told)
    if message.constants:
        shown = [f"{name}={value}" for name, value in message.constants.items()]
        yield f"{INDENT * depth}# constants: {', '.join(shown[:MOST_CONSTANTS])}"


def say_fields(message: MessageType) -> str:
    """Return a type's own fields in a sentence: "Its fields are x: float64, y: float64."."""
    fields = ", ".join(map(_say_field, message.fields))
    return f"Its fields are {fields}." if fields else "It has no fields."


def _say_field(field: Field) -> str:
    default = f" = {field.default}" if field.default not in ("", "0", "false") else ""
    return f"{field.name}: {field.shown_type}{default}"


def _is_short(message: MessageType) -> bool:
    is_plain = not any(field.is_message for field in message.fields)
    return is_plain and len(message.fields) <= MOST_INLINE and not message.constants


LARGEST_FLOAT32 = 3.4028234663852886e38
BYTES = ("uint8", "char", "byte")
NUMBERS = frozenset((*FLOATS, *WHOLES, "bool"))
UNSENDABLE = re.compile("[\x00\ud800-\udfff]")
MOST_SHOWN = 40


def check_message(book: TypeBook, type_name: str, message: object) -> dict[str, Any]:
    """Return a message as it may be sent: fields left out stay out, whole numbers become floats.

    Every message is checked here before it is sent: no link checks messages, except rosbridge's for
    what JSON can hold. Lists of numbers may be numpy arrays; uint8[] may be bytes or, as in JSON,
    base64.

    Raises:
        LinkError: It does not fit; names the field's path and what its type wants.
    """
    return _check(book, type_name, message, path="")


def _check(book: TypeBook, type_name: str, message: object, *, path: str) -> dict[str, Any]:
    if not book.knows(type_name):
        raise LinkError(
            f"{path or 'The message'} is a {type_name}, which nobody has described.",
            hint="Give its definition first.",
        )
    message_type = book[type_name]
    if not isinstance(message, Mapping) or path.count(".") > MOST_NESTED:
        raise _misfit(path or "message", f"an object of type {type_name}", message, message_type)
    fields = {field.name: field for field in message_type.fields}
    strangers = [str(name) for name in message if name not in fields]
    if strangers:
        raise _stranger(strangers[0], message_type, path)
    return {
        name: _check_field(book, fields[name], value, path=_join(path, name))
        for name, value in message.items()
    }


def _check_field(book: TypeBook, field: Field, value: object, *, path: str) -> Any:  # noqa: ANN401 - ROS JSON
    """Return one field as it may be sent; see `check_message`."""
    if field.length is None:
        return _check_value(book, field, value, path=path)
    n_values = _count(field, value)
    if n_values is None:
        or_bytes = ", or bytes in base64" if field.type in BYTES else ""
        raise _misfit(path, f"a list ({field.shown_type}){or_bytes}", value)
    _check_length(field, n_values, path)
    if isinstance(value, np.ndarray):
        return _check_array(book, field, value, path=path)
    if not isinstance(value, list | tuple):
        return value
    return [
        _check_value(book, field, each, path=f"{path}[{number}]")
        for number, each in enumerate(value)
    ]


def _count(field: Field, value: object) -> int | None:
    """Return how many values a list has; None for a value that is not a list for that field."""
    if isinstance(value, str):
        return _n_bytes(value) if field.type in BYTES else None
    if isinstance(value, bytes | bytearray | memoryview):
        return len(value) if field.type in BYTES else None
    if isinstance(value, np.ndarray):
        return len(value) if value.ndim == 1 else None
    return len(value) if isinstance(value, list | tuple) else None


def _check_array(book: TypeBook, field: Field, values: NDArray[Any], *, path: str) -> NDArray[Any]:
    kinds = {"bool": "b"}.get(field.type, "iuf" if field.type in FLOATS else "iu")
    if values.size and (field.type not in NUMBERS or values.dtype.kind not in kinds):
        raise _misfit(path, f"a list of numbers ({field.shown_type})", f"{values.dtype}")
    # A NaN or an infinity in the list is the least or the largest value.
    for extreme in (values.min(), values.max()) if values.size else ():
        _check_value(book, field, extreme, path=path)
    return values


def _check_length(field: Field, length: int, path: str) -> None:
    is_wrong = bool(field.length) and length != field.length
    if is_wrong or (field.most is not None and length > field.most):
        raise LinkError(
            f"{path} has {length} values; its type is {field.shown_type}.",
            hint=f"Give {field.length or f'at most {field.most}'} values.",
        )


def _check_value(book: TypeBook, field: Field, value: object, *, path: str) -> Any:  # noqa: ANN401 - ROS JSON
    kind = field.type
    if isinstance(value, np.generic):
        value = value.item()
    if kind in FLOATS:
        return _check_float(kind, value, path)
    if kind in WHOLES:
        low, high = WHOLES[kind]
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if not is_whole or not low <= value <= high:  # type: ignore[operator]
            raise _misfit(path, f"a whole number from {low} to {high} ({kind})", value)
        return value
    if kind == "bool":
        if not isinstance(value, bool):
            raise _misfit(path, "true or false (bool)", value)
        return value
    if kind in TEXTS:
        return _check_text(field, value, path)
    return _check(book, kind, value, path=path)


def _check_float(kind: str, value: object, path: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _misfit(path, f"a number ({kind})", value)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number) or (kind == "float32" and abs(number) > LARGEST_FLOAT32):
        raise _misfit(path, f"a finite number ({kind})", value)
    return number


def _check_text(field: Field, value: object, path: str) -> str:
    # Half a surrogate pair or a zero can be said in JSON, and no wire of ROS can carry it.
    if not isinstance(value, str) or UNSENDABLE.search(value):
        raise _misfit(path, f"a text ({field.shown_type})", value)
    if field.most_letters is not None and len(value) > field.most_letters:
        raise LinkError(
            f"{path} has {len(value)} letters; its type is {field.shown_type}.",
            hint=f"Give at most {field.most_letters} letters.",
        )
    return value


def _n_bytes(text: str) -> int | None:
    try:
        return len(base64.b64decode(text, validate=True))
    except ValueError:
        return None


def _stranger(name: str, message: MessageType, path: str) -> LinkError:
    known = [field.name for field in message.fields]
    near = difflib.get_close_matches(name, known, n=1)
    meant = f" Did you mean {_join(path, near[0])}?" if near else ""
    return LinkError(
        f"{message.name} has no field {_join(path, name)[:MOST_SHOWN]!r}.{meant}",
        hint=say_fields(message),
    )


def _misfit(path: str, wanted: str, value: object, kind: MessageType | None = None) -> LinkError:
    shown = repr(value)
    if len(shown) > MOST_SHOWN:
        shown = f"{shown[: MOST_SHOWN - 3]}..."
    hint = say_fields(kind) if kind else "Correct that field and send again."
    return LinkError(f"{path} wants {wanted}, not {shown}.", hint=hint)


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
