"""What is remembered of a request, in words: how far to trust it, and what to do next."""

from collections.abc import Iterable, Iterator, Sequence

from mapspeak.errors import GoalError
from mapspeak.geometry import Point
from mapspeak.memory import PictureBook
from mapspeak.memory.quoting import name_key, quote, quote_name
from mapspeak.memory.search.answer import Answer, Basis, EntryCandidate, MatchEvidence, Verdict
from mapspeak.memory.store.forgetting import Forgotten
from mapspeak.memory.things.approach import LOOK_AGAIN_M
from mapspeak.memory.things.labels import name_the_same
from mapspeak.memory.things.thing import Thing
from mapspeak.places.asking import Recall
from mapspeak.places.candidate import RecallCandidate, RecallDoubt
from mapspeak.places.goalcheck import say_check
from mapspeak.places.naming import say_spot
from mapspeak.places.recall.undescribed import UndescribedPicture
from mapspeak.places.relations.choosing import find_places
from mapspeak.places.relations.grammar import Several, Superlative, parse_relation
from mapspeak.places.relations.vocabulary import Kind
from mapspeak.server.text.findings import say_guess
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import list_some, say_count, shorten_around
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace

LONGEST_QUOTE = 120
MOST_PICTURES_NAMED = 12
DESCRIBE = (
    "{write_semantic_data} takes many at once, in more. {recall_episodes} with picture_of "
    "undescribed shows them."
)
MOST_LEFT_NAMED = 100
LOOK_FOR = "Look for it with {search_for}."
OTHERWISE = "Else see why the others are listed, or say it in other words."
LOOK_FOR_REST = "What is not remembered {search_for} finds."
LOOK_AGAIN = (
    "Look again on arrival: the robot stops where most of the places where it may be are in view. "
    "{write_semantic_data} with its column in that picture places it; then drive on."
)
DOUBTS = {
    RecallDoubt.DOUBTFUL_RECORD: "its record is doubtful",
    RecallDoubt.NOT_NOTED: "where it is was not noted",
    RecallDoubt.NOT_ON_MAP: "the map does not show yet where it is; its record has it near {there}",
    RecallDoubt.CONTRADICTED: "what was noted of it does not go together",
    RecallDoubt.LONG_AGO: "it was last seen long ago for what it is",
    RecallDoubt.FEW_VIEWS: "no two good views of it agree so far",
    RecallDoubt.IMPRECISE: "its place is known to within {off_m:.1f} m only",
    RecallDoubt.OTHER_ROOM: "it may be in {rooms}",
    RecallDoubt.OUT_OF_SIGHT: "no place is known from which it would be in sight near by",
    RecallDoubt.HARDLY_IN_SIGHT: (
        "much of where it may be would not be in sight from any place near by"
    ),
}


def say_evidence(candidate: RecallCandidate, *, near: Point | None = None) -> str:
    """Say why a candidate is one, and how far it is from the point the request is near to."""
    said = [] if candidate.match is None else [_say_match(candidate.match)]
    if candidate.away_m is not None and near is not None:
        said.append(f"{candidate.away_m:.1f} m from {say_spot(near)}")
    return "; ".join(said)


def _say_match(found: EntryCandidate) -> str:
    """Say what a request matches: a name, a meaning, or which words stand where."""
    match found.basis:
        case Basis.NAME:
            return f"called {quote(found.text, most=LONGEST_QUOTE)}"
        case Basis.MEANING:
            return (
                f"its {found.field} {quote(found.text, most=LONGEST_QUOTE)} is like it in meaning"
            )
        case Basis.WORDS:
            return "; ".join(_say_words(found.evidence)) or f"its {found.field}"


def _say_words(evidence: Sequence[MatchEvidence]) -> Iterator[str]:
    """Yield each text once that says words of the request, with these words."""
    words_of: dict[str, list[str]] = {}
    for each in evidence:
        is_same = each.query_word.casefold() == each.found_word.casefold()
        said = each.found_word if is_same else f"{each.found_word} for {each.query_word}"
        text = shorten_around(each.text, each.found_word, most=LONGEST_QUOTE)
        words_of.setdefault(f"its {each.field} {quote(text)}", []).append(said)
    for text, words in words_of.items():
        yield f"{text} says {', '.join(words)}"


MOST_ELSEWHERE = 3
ELSEWHERE = "{realign_memory} finds out where that lies."


def say_advice(recalled: Recall) -> str:
    """Say the verdict with what to do next."""
    said = _say_verdict(recalled)
    elsewhere = recalled.elsewhere[:MOST_ELSEWHERE]
    if not elsewhere:
        return said
    names = ", ".join(quote_name(each.name) for each in elsewhere)
    return f"{said} On another map it is remembered: {names}. {lead(ELSEWHERE)}".rstrip()


def say_phrase(world: WorldModel, words: str) -> str:
    """Say which rooms, doors or frontiers a phrase such as "smallest room" means; empty for others.

    It is read off the map: nothing has to be remembered of it.
    """
    relation = parse_relation(words)
    kind = relation.kind if isinstance(relation, Superlative | Several) else None
    if kind in (None, Kind.REMEMBERED):
        return ""
    try:
        ids = [each.name for each in find_places(world, words)]
    except GoalError:
        return ""
    said = f"{quote(words)} is {list_some(ids, most=MOST_ELSEWHERE)} on the map."
    return f"{said} {lead('{navigate_to} and {measure} take such words.')}".rstrip()


def _say_verdict(recalled: Recall) -> str:
    answer, candidates = recalled.answer, recalled.candidates
    if not recalled.n_searched:
        if recalled.is_empty:
            return lead(f"Not remembered: nothing is remembered yet. {LOOK_FOR}")
        return lead(f"Not remembered: nothing passes these filters. Leave filters out. {LOOK_FOR}")
    match answer.verdict:
        case Verdict.NOT_REMEMBERED:
            missing = answer.missing
            kind = f" (it sounds like {quote(missing)}, and none is)" if missing else ""
            first = _name(candidates[0]) if candidates else ""
            nearest = f"; the nearest is {first}, which is probably not meant" if first else ""
            said = f"Not remembered{kind}{nearest}. Say it in other words."
            return " ".join(filter(None, (said, lead(LOOK_FOR))))
        case Verdict.SEVERAL:
            return _say_several(answer, candidates[0])
        case Verdict.UNSURE:
            return _say_unsure(answer, candidates[0])
        case Verdict.FOUND | Verdict.LIKELY:
            return _say_found(candidates[0], recalled.doubt) + _say_others(answer.n_meant - 1)


def _say_found(first: RecallCandidate, doubt: RecallDoubt | None) -> str:
    said = f"Found: {_name(first)}."
    if doubt is not None:
        said = f"Likely {_name(first)}, not sure: {_say_doubt(first, doubt)}."
    if not first.check.is_ok:
        return f"{said} But the robot cannot go there: {say_check(first.check)}"
    if doubt and first.position is None:
        way = lead("{navigate_to} {id} goes where it was seen.", id=first.id)
    else:
        way = lead("{navigate_to} takes {id}.", id=first.id)
    return " ".join(filter(None, (said, way, _say_look(first, doubt))))


def _say_look(first: RecallCandidate, doubt: RecallDoubt | None) -> str:
    """Ask for a look at what was found; nothing where it is sure."""
    if doubt is None or first.position is None:
        return ""
    if (first.uncertainty_m or 0.0) > LOOK_AGAIN_M:
        return lead(LOOK_AGAIN)
    return "Look before you rely on it."


def _say_doubt(first: RecallCandidate, doubt: RecallDoubt) -> str:
    if first.is_guessed and doubt in (RecallDoubt.FEW_VIEWS, RecallDoubt.IMPRECISE):
        return f"its place is {say_guess(first.uncertainty_m or 0.0)}"
    rooms = " or ".join(first.room_ids) or "no room"
    there = "" if first.recorded_point is None else say_spot(first.recorded_point)
    return DOUBTS[doubt].format(off_m=first.uncertainty_m, rooms=rooms, there=there)


def _say_others(n_others: int) -> str:
    """Return a sentence for things of the name that fewer views speak for; nothing for none."""
    if not n_others:
        return ""
    are = "others are" if n_others > 1 else "other is"
    return f" {n_others} {are} called so, of which fewer views agree."


def _say_several(answer: Answer, first: RecallCandidate) -> str:
    is_named = answer.candidates[0].basis is Basis.NAME
    are = "are called so" if is_named else "are such a thing"
    nearest = f"; {first.id} is the nearest by path" if first.check.path_m is not None else ""
    if nearest and (first.uncertainty_m or 0.0) > LOOK_AGAIN_M:
        nearest += f", and its place is known to {first.uncertainty_m:.1f} m alone"
    return (
        f"Several: {answer.n_meant} {are}{nearest}. Choose by room, or ask which is meant, then "
        "take its id."
    )


def _say_unsure(answer: Answer, first: RecallCandidate) -> str:
    missing = quote(answer.missing or "")
    kind = f" (the words are nearer to {missing}, and none is remembered)" if answer.missing else ""
    n_same = sum(name_key(each.entry.name) == name_key(first.name) for each in answer.candidates)
    path_m = first.check.path_m
    facts = (
        f"of {n_same} the nearest by path" if n_same > 1 else "",
        "" if path_m is None else f"{path_m:.1f} m away",
    )
    where = ", ".join(filter(None, facts))
    said = (
        f"Unsure: nothing is called so{kind}. The likeliest is {_name(first)}"
        f"{f' ({where})' if where else ''}: if that is meant,"
    )
    take = lead("{navigate_to} takes {id}.", id=first.id) or f"take {first.id}."
    return " ".join(filter(None, (said, take, OTHERWISE, lead(LOOK_FOR_REST))))


def _name(candidate: RecallCandidate) -> str:
    return f"{candidate.id} {quote(candidate.name, most=LONGEST_QUOTE)}"


def say_places_left(left: Sequence[RememberedPlace], *, first: int) -> Iterator[str]:
    """Name the places that a page leaves out, and say how to read them.

    Args:
        first: The number of the first of them.
    """
    if not left:
        return
    named = [f"{each.id} {quote_name(each.waypoint.name)}" for each in left]
    told = list_some(named, most=MOST_LEFT_NAMED)
    yield f"{len(left)} left out, from_row={first} goes on: {told}."


def say_undescribed(
    pictures: Sequence[UndescribedPicture], book: PictureBook, *, most: int = MOST_PICTURES_NAMED
) -> list[str]:
    """Offer the pictures that nothing was written of, to be described in one call."""
    if not pictures:
        return []
    named = [say_picture(each, book) for each in pictures[:most]]
    if named and len(pictures) > most:
        named.append(f"and {len(pictures) - most} more")
    said = f"{say_count(len(pictures), 'picture')} without words"
    return [f"{': '.join(filter(None, (said, '; '.join(named))))}. {lead(DESCRIBE)}".rstrip()]


def say_picture(each: UndescribedPicture, book: PictureBook) -> str:
    """Return by which id a picture is described, where it was taken, and what is known of it."""
    seen = each.match.observation
    taken = book.find(seen.picture or "")
    parts = [f"{taken.id if taken else seen.id} in {seen.room_id or 'no room'}"]
    if seen.labels:
        parts.append(f"the detector saw {quote(', '.join(seen.labels), most=LONGEST_QUOTE)}")
    if each.beside is not None:
        parts.append(f"beside {quote_name(each.beside)}")
    return ", ".join(parts)


def say_forgotten(done: Forgotten, words: str, *, is_undo: bool = False) -> str:
    """Say what is forgotten, or remembered again, and how to take it back."""
    parts = [f"the place {quote_name(each)}" for each in done.places]
    if done.n_landmarks:
        named = list_some([*map(quote_name, done.seen_from)], most=MOST_LEFT_NAMED)
        parts.append(f"{say_count(done.n_landmarks, 'view')} of it, noted at {named}")
    if not parts:
        return f"Nothing that was forgotten is called {quote_name(words)}; nothing changed."
    told = "; ".join(parts)
    if is_undo:
        return f"Remembered again: {told}."
    return lead("Forgotten: {told}. {forget} with undo and its name takes that back.", told=told)


def say_gone(label: str, done: Forgotten | None, *, ids: Sequence[str], is_in_record: bool) -> str:
    """Say what became of a thing that is said to be gone; nothing where only its record had it.

    Args:
        done: What was forgotten in other records; None where it is not clear which thing is meant.
        ids: Of the things that may be meant.
        is_in_record: The record that was just written had it.
    """
    named = quote_name(label)
    if done is not None and done.n_landmarks:
        return f"{named} ({ids[0]}) is forgotten, as noted at {', '.join(done.seen_from)} too."
    if len(ids) > 1:
        meant = ", ".join(ids)
        return lead("{named} may be {meant}: {forget} takes the id.", named=named, meant=meant)
    return "" if is_in_record or done is not None else f"Nothing near by is remembered as {named}."


def say_placed(world: WorldModel, name: str, labels: Iterable[str]) -> list[str]:
    """Say by id which things of some labels a place speaks for, and where each is taken to be."""
    named = tuple(labels)
    return [
        f"{each.id} {quote_name(each.thing.label)}{_say_whereabouts(each.thing)}"
        for each in world.things
        if name in each.thing.waypoints
        and any(name_the_same(each.thing.label, label) for label in named)
    ]


def _say_whereabouts(thing: Thing) -> str:
    if thing.position is None:
        return ", nobody noted where"
    radius_m = thing.uncertainty_m or 0.0
    how_well = say_guess(radius_m) if thing.is_guessed else f"within {radius_m:.1f} m"
    return f" at {say_spot(thing.position)}, {how_well}"
