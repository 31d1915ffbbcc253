"""The types of one ROS 2 system: those we know, and those its nodes describe to us."""

from collections.abc import Mapping
from typing import Any

from mapspeak.links.dds.cdr import Codec
from mapspeak.links.dds.definitions import build_type_book, read_type_description
from mapspeak.ros.definitions import TypeBook, name_parts
from mapspeak.ros.messages import Message, bare_type


class Types:
    """Encodes and decodes, after the definitions known so far."""

    def __init__(self) -> None:
        self._use(build_type_book())

    def encode(self, type_name: str, message: Mapping[str, Any]) -> bytes:
        """Gives the bytes of a message.

        Raises:
            LinkError: It does not fit its type, or nobody knows the type.
        """
        return self._codec.encode(type_name, message)

    def decode(self, type_name: str, data: bytes, skip: int = 0) -> dict[str, Any]:
        """Gives the message in some bytes, behind so many that are something else.

        Raises:
            LinkError: It is none of that type, or nobody knows the type.
        """
        return self._codec.decode(type_name, data, skip=skip)

    def knows(self, type_name: str) -> bool:
        """True for a message type whose fields, and the fields of all within, are known."""
        return self._book.knows(type_name) and not self._book.missing(type_name)

    def take_humble(self) -> None:
        """Takes in that the robot runs Humble, where some types were others."""
        self._use(build_type_book(is_humble=True))

    def take_description(self, answer: Message) -> None:
        """Takes in what a node says of a type.

        Raises:
            LinkError: It does not describe it.
        """
        self._use(TypeBook({**self._book.texts, **read_type_description(answer)}))

    def definitions(self, type_name: str) -> dict[str, str]:
        """Gives the texts of a type and of all within; see `RosConnection.fetch_definitions`."""
        candidates = ((bare_type(type_name),), *name_parts(type_name))
        found = next((names for names in candidates if all(map(self._book.knows, names))), ())
        within = [name for each in found for name in self._book.within(each)]
        return {name: self._book.texts[name] for name in dict.fromkeys((*found, *within))}

    def _use(self, book: TypeBook) -> None:
        self._book, self._codec = book, Codec(book)
