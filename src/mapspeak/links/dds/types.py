"""The types of one ROS 2 system: those we know, and those its nodes describe to us."""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.links.dds.cdr import Codec
from mapspeak.links.dds.definitions import build_type_book, read_type_description
from mapspeak.ros.definitions import DISTROS, TypeBook, hash_type, name_parts
from mapspeak.ros.messages import Message, bare_type

HUMBLE = "humble"


class Types:
    """Encodes and decodes, after the definitions known so far.

    Args:
        distro: Of ROS 2, whose definitions count until the robot tells; see `known_definitions`.
    """

    def __init__(self, *, distro: str = "") -> None:
        self._distro = distro
        self._hashes: dict[str, str] = {}
        self._other_versions: set[str] = set()
        self._book = _book_of(distro)
        self._codec = Codec(self._book)

    def encode(self, type_name: str, message: Mapping[str, Any]) -> bytes:
        """Gives the bytes of a message.

        Raises:
            LinkError: It does not fit its type, or we do not know the type as the robot has it.
        """
        if self._is_other_version(type_name):
            raise self.refusal(type_name)
        return self._codec.encode(type_name, message)

    def decode(self, type_name: str, data: bytes) -> dict[str, Any]:
        """Gives the message in some bytes.

        Raises:
            LinkError: It is none of that type, or nobody knows the type.
        """
        return self._codec.decode(type_name, data)

    def knows(self, type_name: str) -> bool:
        """True for a type as the robot has it, whose fields, and those of all within, are known."""
        return (
            self._book.knows(type_name)
            and not self._book.missing(type_name)
            and not self._is_other_version(type_name)
        )

    def refusal(self, type_name: str) -> LinkError:
        """Gives the error for a type that is not known as the robot has it."""
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
        """Takes in that the robot runs Humble, whose nodes tell no hashes."""
        if self._distro != HUMBLE:
            self._distro = HUMBLE
            self._use(_book_of(HUMBLE))

    def take_hash(self, type_name: str, type_hash: str) -> None:
        """Takes in the hash of a type on the robot: of the versions we know, the one that has it.

        Args:
            type_name: Of a message, or of a part of a service or an action.
            type_hash: As DDS tells it since ROS 2 Iron; empty before.
        """
        bare = bare_type(type_name)
        if not type_hash or self._hashes.get(bare) == type_hash:
            return
        self._hashes[bare] = type_hash
        books = [book for book in self._versions() if book.knows(bare)]
        fitting = next((book for book in books if _has_hash(book, bare, type_hash)), None)
        if fitting is None:
            self._other_versions |= {bare} if books else set()
            return
        self._other_versions.discard(bare)
        if fitting is not self._book:
            texts = {name: fitting.texts[name] for name in fitting.within(bare)}
            self._use(TypeBook({**self._book.texts, **texts}))

    def _versions(self) -> Iterator[TypeBook]:
        yield self._book
        yield from map(_book_of, DISTROS)

    def take_description(self, answer: Message) -> None:
        """Takes in what a node says of a type.

        Raises:
            LinkError: It does not describe it.
        """
        texts = read_type_description(answer)
        self._other_versions -= texts.keys()
        self._use(TypeBook({**self._book.texts, **texts}))

    def definitions(self, type_name: str) -> dict[str, str]:
        """Gives the texts of a type and of all within; see `RosConnection.fetch_definitions`."""
        candidates = ((bare_type(type_name),), *name_parts(type_name))
        found = next((names for names in candidates if all(map(self._book.knows, names))), ())
        within = [name for each in found for name in self._book.within(each)]
        return {name: self._book.texts[name] for name in dict.fromkeys((*found, *within))}

    def _use(self, book: TypeBook) -> None:
        self._book, self._codec = book, Codec(book, self._codec.store)


def _has_hash(book: TypeBook, name: str, type_hash: str) -> bool:
    try:
        return hash_type(book, name) == type_hash
    except LinkError:
        return False


_book_of = cache(build_type_book)
