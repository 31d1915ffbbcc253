"""Whether two labels may name one thing: by their nouns, their marks and what is commonly known."""

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from mapspeak.memory.policy import half_lives, words_of
from mapspeak.memory.search.kinds import ThingKind, find_kinds, find_kinds_called
from mapspeak.memory.search.wordindex import without_accents
from mapspeak.memory.things.thing import Stance

INSTALLED_H = 5 * 365 * 24.0
"""What is fixed to the building stays for years."""
MOST_KEPT = 65_536
"""So many different labels are taken apart once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Parts:
    """What a label is made of.

    Attributes:
        tokens: In the singular, without marks and looks; the last one is the noun.
        marks: Numbers and letters by which like things are told apart: "3", "b", "p1".
        sides: Words such as "left", likewise.
        kinds: Of which all words together are a name.
    """

    tokens: tuple[str, ...]
    marks: frozenset[str]
    sides: frozenset[str]
    kinds: tuple[ThingKind, ...]


@lru_cache(maxsize=MOST_KEPT)
def name_the_same(label: str, other: str) -> bool:
    """Return True when two labels may name one thing.

    One says no more than the other leaves open, and both end in one noun: "extinguisher", "red
    extinguisher" and "fire extinguishers" name the same; "coffee machine" and "washing machine" do
    not, though "machine" may be either. Or both are names of one kind, as "fridge" and
    "refrigerator" are. Numbers, letters and sides that differ keep them apart: "gate 3" is not
    "gate 4", and "gate" may be either.
    """
    one, two = _parts_of(label), _parts_of(other)
    return not _are_marked_apart(one, two) and _have_one_name(one, two)


def names_no_less(label: str, asked: str) -> bool:
    """Return True for a label that names what is asked for and leaves none of it open.

    "charger 2" and "red charger" do for "chargers"; "charger" does for neither of them.
    """
    if not name_the_same(label, asked):
        return False
    words, known = (
        tuple(map(_singular, _TOKEN.findall(without_accents(each)))) for each in (asked, label)
    )
    is_kind = not set(find_kinds_called(" ".join(words))).isdisjoint(_parts_of(label).kinds)
    return is_kind or set(words) <= set(known)


@lru_cache(maxsize=MOST_KEPT)
def find_stance(label: str) -> Stance:
    """Return where such things are, as is commonly known: a fire extinguisher hangs on a wall."""
    parts = _parts_of(label)
    if parts.tokens[-1] in words_of("free"):
        return Stance.FREE
    names = (name for kind in parts.kinds or find_kinds(label) for name in kind.names)
    return Stance.ANYWHERE if words_of("on_walls").isdisjoint(names) else Stance.ON_WALL


@lru_cache(maxsize=MOST_KEPT)
def find_half_life_s(label: str) -> float:
    """Return after how long half of such things stand elsewhere, by what they are called."""
    noun = _parts_of(label).tokens[-1]
    hours = (float(hours) for hours, words in half_lives().items() if noun in words)
    return 3600.0 * next(hours, INSTALLED_H)


def group_names(labels: Sequence[str]) -> list[frozenset[str]]:
    """Return labels that may, over others, name the same; each label is in one group."""
    by_words: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
    for label in sorted(set(labels)):
        by_words[_parts_of(label).tokens].append(label)
    return [
        group
        for related in _join_related([_parts_of(same[0]) for same in by_words.values()])
        for group in _divide_by_marks(label for words in related for label in by_words[words])
    ]


def _have_one_name(one: _Parts, two: _Parts) -> bool:
    if not set(one.kinds).isdisjoint(two.kinds):
        return True
    some, others = set(one.tokens), set(two.tokens)
    return one.tokens[-1] == two.tokens[-1] and (some <= others or others <= some)


def _are_marked_apart(one: _Parts, two: _Parts) -> bool:
    pairs = ((one.marks, two.marks), (one.sides, two.sides))
    return any(some and others and some != others for some, others in pairs)


def _join_related(named: Sequence[_Parts]) -> list[list[tuple[str, ...]]]:
    """Return which rows of words may, over others, be of one name."""
    near: defaultdict[object, list[_Parts]] = defaultdict(list)
    for parts in named:
        for key in (parts.tokens[-1], *parts.kinds):
            near[key].append(parts)
    group_of = {parts.tokens: [parts.tokens] for parts in named}
    for alike in near.values():
        for i, one in enumerate(alike):
            for two in alike[:i]:
                mine, other = group_of[one.tokens], group_of[two.tokens]
                if mine is not other and _have_one_name(one, two):
                    mine += other
                    group_of.update(dict.fromkeys(other, mine))
    return list({id(group): group for group in group_of.values()}.values())


def _divide_by_marks(labels: Iterable[str]) -> list[frozenset[str]]:
    """Divide labels of one name by their marks, unless one without any may be each of them."""
    by_marks: defaultdict[frozenset[str], set[str]] = defaultdict(set)
    for label in labels:
        by_marks[_parts_of(label).marks].add(label)
    if frozenset() in by_marks:
        return [frozenset().union(*by_marks.values())]
    return [frozenset(same) for same in by_marks.values()]


_TOKEN = re.compile(r"[^\W_]+(?:[.,]\d+)?")
_MEASURE = re.compile(
    r"\d+(?:[.,]\d+)? ?(?:mm|cm|m|km|g|kg|t|l|litres?|liters?|v|w|kw|a|inch|in)\b"
)


@lru_cache(maxsize=MOST_KEPT)
def _parts_of(label: str) -> _Parts:
    plain = _MEASURE.sub(" ", without_accents(label))
    # A place or a detail after the noun, as in "sink with a mirror", does not change the noun.
    head = re.split(r"\b(?:with|on|in|at|near|under|behind|beside|for|of)\b|[,(;]", plain)[0]
    tokens = _TOKEN.findall(head)
    marks = frozenset(
        token.lstrip("0") or token
        for number, token in enumerate(tokens)
        if _is_mark(token, tokens, number)
    )
    words = [token for token in tokens if token not in marks and not token.isdigit()]
    singular = tuple(map(_singular, words)) or (plain.strip(),)
    # In "first aid kit" and "back rest" they are part of the name.
    whole = find_kinds_called(" ".join(singular))
    sides = frozenset[str]() if whole else words_of("sides").intersection(singular)
    told = tuple(word for word in singular if word not in words_of("looks") | sides) or singular
    kinds = whole or find_kinds_called(" ".join(told))
    return _Parts(tokens=told, marks=marks, sides=sides, kinds=kinds)


def _is_mark(token: str, tokens: Sequence[str], number: int) -> bool:
    """Return True for "3" in "gate 3", "b" in "gate B" and "p1"; not for "2 gates" and "a gate"."""
    is_first = number == 0
    if token.isdigit():
        # "2 chairs" counts them.
        is_count = is_first and len(tokens) > 1 and _singular(tokens[-1]) != tokens[-1]
        return not is_count
    if any(each.isdigit() for each in token):
        return True
    return len(token) == 1 and not (is_first and len(tokens) > 1)


def _singular(word: str) -> str:
    if len(word) > 4 and word.endswith(("ses", "xes", "zes", "ches", "shes")):
        return word[:-2]
    if len(word) > 4 and word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-1] if len(word) > 3 and word.endswith("s") and word[-2] not in "su" else word
