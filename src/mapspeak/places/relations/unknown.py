"""Words that name no place: what became of it, and what may be meant instead."""

import difflib
import re
from collections.abc import Iterator, Sequence

from mapspeak.errors import GoalError, NextStep
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.search.answer import Basis, EntryKind, Verdict
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.places.candidate import RecallCandidate
from mapspeak.places.naming import ARTICLE, ID, IDS, MOST_NAMED, REGION_ID, find_elsewhere
from mapspeak.places.relations.grammar import KINDS, Several, Superlative, parse_relation
from mapspeak.places.relations.vocabulary import COUNTS, ORDERS, RANKS, Kind, pattern
from mapspeak.spatial.rooms import RoomClass
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.reported import list_reported

MOST_GUESSES = 3
MOST_OF_A_NAME = 3
"""Of more words, and no id, who says them asks for what fits, not for a place by its name."""
OF_THE_MAP = pattern(rf"\b(?:{KINDS[Kind.DOOR]}|{KINDS[Kind.CORRIDOR]}|frontier)s?\b")
"""Who speaks of these means no place in whose description one of them stands."""


def no_such_place(world: WorldModel, words: str) -> GoalError:
    """Return the error for words that name no place: what became of it, and what there is."""
    wanted = words.strip()
    became = _find_became(world, wanted)
    if became is not None:
        return GoalError(f"{wanted.upper()} is {became} now.", hint=f"Use {became}.")
    hint, step = _known_places(world, wanted)
    return GoalError(_what_became_of(world, wanted), hint=hint, step=step)


def _find_became(world: WorldModel, wanted: str) -> str | None:
    """Return the id of the thing that another one was joined with."""
    match = ID.fullmatch(wanted)
    is_thing = match is not None and world.recollection.ids.has_given(wanted.upper())
    found = world.recollection.find_became(wanted.upper()) if is_thing else None
    return None if found is None else found.id


def _what_became_of(world: WorldModel, place: str) -> str:
    gone = next((each for each in world.rooms.vanished if each.id == place.upper()), None)
    if gone is not None and gone.became:
        return f"{gone.id} is no longer found: its floor is now {' and '.join(gone.became)}."
    if gone is not None:
        return f"{gone.id} is no longer found on the map."
    match = ID.fullmatch(place)
    letter, number = (match["letter"].upper(), int(match["number"])) if match else ("", 0)
    if letter == "F" and 1 <= number <= world.frontiers.n_named:
        return f"Frontier {place.upper()} is gone: what lay behind it has been seen or refused."
    if letter == "T" and world.recollection.ids.has_given(place.upper()):
        return f"The thing {place.upper()} is no longer remembered."
    if find_elsewhere(world.memory, place):
        return f"{place[:80]!r} is remembered on another map; where that lies is not known here."
    return f"There is no place called {place[:80]!r}."


def _known_places(world: WorldModel, wanted: str) -> tuple[str, NextStep]:
    if find_elsewhere(world.memory, wanted):
        return "Let the robot see more of the building", NextStep.ALIGN
    if ID.fullmatch(wanted):
        return _say_ids(world, wanted.upper()), NextStep.SEE_PLACES
    phrases = _say_phrases(world, wanted)
    guesses = _guess(world, wanted) if world.places and not IDS.fullmatch(wanted) else ()
    if guesses:
        return f"{_say_guesses(guesses)} {phrases}", NextStep.READ_MORE
    if not IDS.fullmatch(wanted) and (shown := _find_reported(world, wanted)) is not None:
        seen = f"Pictures show {quote_name(shown)}, which is not written down. If that is meant, "
        return f"{seen}use {f'nearest {shown}'!r}. {phrases}", NextStep.READ_MORE
    is_told = len(wanted.split()) > MOST_OF_A_NAME and not REGION_ID.search(wanted)
    return phrases, NextStep.READ_MORE if is_told else NextStep.SEE_PLACES


def _find_reported(world: WorldModel, wanted: str) -> str | None:
    """Return the label of what pictures show at known places and words may mean."""
    index, labels = world.recollector.reports.index, list_reported(world.pictures)
    meant = index.find_meant(wanted, labels)
    return next((each for each in meant if world.join_reported([each])), None)


def _say_ids(world: WorldModel, wanted: str) -> str:
    """Say which id is spelt most like one, and which of its kind there are, else all."""
    groups = {
        "rooms and corridors": [region.id for region in world.rooms.regions],
        "doors": [door.id for door in world.rooms.doors],
        "frontiers": [frontier.id for frontier in world.frontiers.frontiers],
        "remembered": [place.id for place in world.places],
    }
    same = {name: ids for name, ids in groups.items() if any(each[0] == wanted[0] for each in ids)}
    known = [f"{name} {_some_of(ids)}" for name, ids in (same or groups).items() if ids]
    like = _find_like(wanted, [each for ids in same.values() for each in ids])
    meant = f"{like} is spelt most like it. " if like else ""
    return f"{meant}Known are {'; '.join(known) or 'no places yet'}."


def _find_like(wanted: str, ids: Sequence[str]) -> str | None:
    """Find the id that another was most likely misspelt from: first one of the same digits."""
    near = difflib.get_close_matches(wanted, ids, n=len(ids) or 1)
    return next((each for each in near if sorted(each) == sorted(wanted)), next(iter(near), None))


def _guess(world: WorldModel, wanted: str) -> tuple[RecallCandidate, ...]:
    """Return what is meant by what is remembered, with its way; by a bare noun no mere likeness.

    A "kitchen" is no thing that is only like it. What shares a word alone is named by no refusal.
    """
    recalled = recall(world, RecallQuery(words=wanted, n=MOST_GUESSES))
    if recalled.verdict in (Verdict.NOT_REMEMBERED, Verdict.UNSURE):
        return ()
    is_bare = len(ARTICLE.sub("", wanted, count=1).split()) == 1
    return tuple(
        each
        for each in recalled.candidates
        if not (is_bare and _is_by(each, Basis.MEANING) and each.kind is EntryKind.THING)
        and not (OF_THE_MAP.search(wanted) and _is_by(each, Basis.WORDS))
    )


def _is_by(candidate: RecallCandidate, basis: Basis) -> bool:
    return candidate.match is not None and candidate.match.basis is basis


MOST_PHRASES = 3
COUNTED = re.compile(r"\b[a-z][a-z0-9]*?(?=s?\b)")
"""Words, a plural as its singular."""


def _say_phrases(world: WorldModel, wanted: str) -> str:
    """Say what words would be read here, those first that share most with the words."""
    said = set(COUNTED.findall(wanted.casefold()))
    # Who drives a robot speaks of it so; a person may mean himself, and is asked.
    said |= {"robot"} if said & {"me", "my"} else set()
    near = sorted(_list_phrases(world, wanted), key=lambda each: -_count_shared(each, said))
    respelt = _respell(wanted)
    if respelt is not None:
        near = [respelt, *(each for each in near if each != respelt)]
    return f"Such words can be read: {', '.join(map(repr, near[:MOST_PHRASES]))}."


OTHERS = "all every middle between rooms doors"
SPELT = sorted(
    {
        word
        for words in (*ORDERS.values(), *Kind, *RANKS, *COUNTS, OTHERS)
        for word in re.findall(r"\w+", words)
    }
)
"""Words of phrases that are known again where they are misspelt."""


def _respell(wanted: str) -> str | None:
    """Return words as a phrase for a place, misspelt ones put right; None where that makes none."""
    words = wanted.split()
    near = (difflib.get_close_matches(each.casefold(), SPELT, n=1, cutoff=0.8) for each in words)
    respelt = " ".join(right[0] if right else word for word, right in zip(words, near, strict=True))
    relation = parse_relation(respelt)
    is_named = isinstance(relation, (Superlative, Several)) and relation.kind is None
    return None if relation is None or is_named or respelt == wanted else respelt


def _count_shared(phrase: str, said: set[str]) -> int:
    return len(said & set(COUNTED.findall(phrase.casefold())) - {"of", "the", "to", "in"})


def _list_phrases(world: WorldModel, wanted: str) -> Iterator[str]:
    """Yield phrases that mean something here, of the regions that the words name."""
    regions = world.rooms.regions
    named = [each for each in regions if re.search(rf"\b{each.id}\b", wanted, re.IGNORECASE)]
    kinds = {
        "room": any(each.room_class is RoomClass.ROOM for each in regions),
        "door": bool(world.rooms.doors),
        "corridor": any(each.room_class is RoomClass.CORRIDOR for each in regions),
    }
    for region in named[:1]:
        if world.rooms.doors_of(region):
            yield f"all doors of {region.id}"
        yield from (f"{where} {region.id}" for where in ("the middle of", "next to", "facing"))
    known = [kind for kind, is_known in kinds.items() if is_known]
    yield from (f"nearest {kind}" for kind in known)
    yield from (f"largest {kind}" for kind in known)
    yield from (f"all {kind}s" for kind in known)
    yield from (f"the middle of {each.id}" for each in regions[:1])
    yield "2 m in front of the robot"
    yield "left of the robot"


def _say_guesses(guesses: Sequence[RecallCandidate]) -> str:
    """Name what may be meant, for the reader to confirm: likeness alone does not make a goal."""
    first = guesses[0]
    by = "meaning" if _is_by(first, Basis.MEANING) else "words"
    told = ", ".join(map(_say_guess, guesses))
    return (
        f"Nothing remembered is called so; nearest in {by}: {told}. If {first.id} is meant, "
        f"use {first.id}."
    )


def _say_guess(guess: RecallCandidate) -> str:
    path_m = guess.check.path_m
    way = "no way" if path_m is None else f"{path_m:.1f} m by path"
    return f"{guess.id} {quote_name(guess.name)} ({way})"


def _some_of(ids: list[str]) -> str:
    shown = " ".join(ids[:MOST_NAMED])
    return shown if len(ids) <= MOST_NAMED else f"{shown} and {len(ids) - MOST_NAMED} more"
