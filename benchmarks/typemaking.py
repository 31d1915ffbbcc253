"""Message types made up at random: nested, with lists bounded and not, from a seed."""

import random
from typing import Any

from mapspeak.ros.definitions.texts import known_definitions
from mapspeak.ros.definitions.types import FLOATS, TIMES, WHOLES, Field, TypeBook
from mapspeak.ros.messages.fields import Dialect

__all__ = ["make_message", "make_types"]

PLAIN = (*FLOATS, *(kind for kind in WHOLES if kind not in ("byte", "char")), "bool", "string")
DEEPEST = 5
N_MADE_UP = 120
N_TYPES = 200
MOST_VALUES = 3


def make_types(
    seed: int, *, dialect: Dialect, n: int = N_TYPES, n_made_up: int = N_MADE_UP
) -> tuple[TypeBook, list[str]]:
    """Return a book, and the names of so many types in it, standard ones and made up."""
    known = known_definitions(dialect)
    book = TypeBook(known)
    # ROS 1 has times of its own: what looks like those of ROS 2 is served as one of these.
    foreign = "builtin_interfaces/" if dialect is Dialect.ROS1 else "none/"
    fitting = [
        name
        for name, text in sorted(known.items())
        if not book.missing(name) and "wstring" not in text and not name.startswith(foreign)
    ]
    dice = random.Random(seed)  # noqa: S311 - no secrets
    maker = _Maker(
        dice, [name for name in fitting if name.startswith(("geometry_msgs", "std_msgs"))]
    )
    names = [maker.make(depth=dice.randint(0, DEEPEST - 1)) for _ in range(n_made_up)]
    standard = dice.sample(fitting, n - n_made_up)
    return TypeBook({**known, **maker.texts}), [*names, *standard]


class _Maker:
    def __init__(self, dice: random.Random, standard: list[str]) -> None:
        self._dice = dice
        self._standard = standard
        self.texts: dict[str, str] = {}

    def make(self, *, depth: int) -> str:
        """Make one type with that many levels of messages within, and return its name."""
        lines = [self._plain() for _ in range(self._dice.randint(1, 4))]
        n_within = self._dice.randint(1, 2) if depth else 0
        lines += [self._field(self.make(depth=depth - 1)) for _ in range(n_within)]
        if depth and self._dice.random() < 0.3:
            lines.append(self._field(self._dice.choice(self._standard)))
        self._dice.shuffle(lines)
        name = f"made_msgs/Type{len(self.texts)}"
        self.texts[name] = "\n".join(f"{line} f{at}" for at, line in enumerate(lines))
        return name

    def _plain(self) -> str:
        kind = self._dice.choice(PLAIN)
        if kind == "string" and self._dice.random() < 0.3:
            kind = f"string<={self._dice.randint(1, 20)}"
        return self._field(kind)

    def _field(self, kind: str) -> str:
        most = self._dice.randint(1, 5)
        return f"{kind}{self._dice.choice(('', '', '', '[]', f'[{most}]', f'[<={most}]'))}"


def make_message(book: TypeBook, name: str, dice: random.Random) -> dict[str, Any]:
    """Return a message of a type with something in each of its fields."""
    return {field.name: _value(book, field, dice) for field in book[name].fields}


def _value(book: TypeBook, field: Field, dice: random.Random) -> Any:  # noqa: ANN401 - ROS JSON
    if field.length is None:
        return _one(book, field, dice)
    n_values = field.length or dice.randint(0, min(field.most or MOST_VALUES, MOST_VALUES))
    return [_one(book, field, dice) for _ in range(n_values)]


def _one(book: TypeBook, field: Field, dice: random.Random) -> Any:  # noqa: ANN401 - ROS JSON
    if field.is_message or field.type in TIMES:
        return make_message(book, field.type, dice)
    if field.type in FLOATS:
        # Halves are the same in 32 bits as in 64, and in decimal.
        return dice.randint(-1000, 1000) / 2
    if field.type in WHOLES:
        low, high = WHOLES[field.type]
        return dice.randint(max(low, 0) if field.type == "byte" else low, high)
    if field.type == "bool":
        return dice.random() < 0.5
    letters = dice.choices('aä東 "\\\n', k=min(field.most_letters or MOST_VALUES, MOST_VALUES))
    return "".join(letters)
