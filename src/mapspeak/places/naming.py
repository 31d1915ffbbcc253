"""What a place is called: an id, a remembered name, coordinates, or the robot."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from mapspeak.errors import GoalError
from mapspeak.geometry import Point, wrap_angle
from mapspeak.places.goalcheck import FARTHEST_M
from mapspeak.semantic import name_key
from mapspeak.semantic.quoting import quote_name
from mapspeak.semantic.retrieval import Answer, Basis, Verdict
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import Atlas, RememberedPlace, RememberedThing

__all__ = [
    "MOST_NAMED",
    "NUMBER",
    "ROBOT_NAMES",
    "AmbiguousPlaceError",
    "Place",
    "Spot",
    "Thing",
    "find_named",
    "is_taken_name",
    "no_such_place",
    "say_spot",
]

MOST_NAMED = 12
MOST_GUESSES = 3
ID = re.compile(r"(?P<letter>[A-Za-z])(?P<number>\d+)")
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
SPOT = re.compile(
    rf"\(?\s*(?:x\s*=?\s*)?(?P<x>{NUMBER})\s*[,; ]\s*(?:y\s*=?\s*)?(?P<y>{NUMBER})"
    rf"(?:\s*[,; ]\s*(?:yaw\s*=?\s*)?(?P<yaw_deg>{NUMBER})(?:\s*deg)?)?\s*\)?"
)
ROBOT_NAMES = ("robot", "here")


@dataclass(frozen=True, slots=True)
class Spot:
    """A place by its coordinates.

    Attributes:
        point: Where it is.
        yaw_rad: The heading that was asked for; None where none was.
    """

    point: Point
    yaw_rad: float | None = None


Thing = Region | Door | Frontier | RememberedPlace | RememberedThing | Spot


@dataclass(frozen=True, slots=True)
class Place:
    """Something on the map that has a name.

    Attributes:
        name: Its id, or the words that were used for it.
        thing: What it is.
        reason: Why it is there, where words had to be read for it; else empty.
    """

    name: str
    thing: Thing
    reason: str = ""

    @property
    def point(self) -> Point:
        """Where it is: of a room its widest point, of a frontier where to look from."""
        match self.thing:
            case Region(widest=point) | Door(place=point) | Spot(point=point):
                return point
            case Frontier(pose=pose):
                return pose.point
            case RememberedPlace(waypoint=waypoint):
                return waypoint.pose.point
            case RememberedThing() as remembered:
                return remembered.point


class AmbiguousPlaceError(GoalError):
    """Words that mean several things.

    Attributes:
        words: As they were said.
        meanings: Words for each of the things that mean it alone.
    """

    def __init__(self, message: str, *, hint: str, words: str, meanings: Sequence[str]) -> None:
        super().__init__(message, hint=hint)
        self.words = words
        self.meanings = tuple(meanings)


def find_named(atlas: Atlas, words: str) -> Place | None:
    """Finds what is called so: an id, a remembered name, "x, y", "x, y, yaw", or "robot".

    Raises:
        AmbiguousPlaceError: Several remembered places have that name.
    """
    wanted = words.strip()
    place = _find_by_id(atlas, wanted.upper()) if ID.fullmatch(wanted) else None
    return place or _find_by_name(atlas, wanted) or _read_spot(atlas, wanted)


def no_such_place(atlas: Atlas, words: str) -> GoalError:
    """Gives the error for words that name no place: what became of it, and what there is."""
    wanted = words.strip()
    return GoalError(_what_became_of(atlas, wanted), hint=_known_places(atlas, wanted))


def is_taken_name(name: str) -> bool:
    """True for what is read as something else than a remembered name: "R3", "1, 2", "robot"."""
    words = name.strip()
    is_spot = SPOT.fullmatch(words) is not None
    return ID.fullmatch(words) is not None or is_spot or words.casefold() in ROBOT_NAMES


def say_spot(point: Point) -> str:
    """Gives a point as a name for it."""
    is_on_earth = max(abs(point.x), abs(point.y)) < FARTHEST_M
    return f"({point.x:.2f}, {point.y:.2f})" if is_on_earth else f"({point.x:g}, {point.y:g})"


def _find_by_id(atlas: Atlas, place_id: str) -> Place | None:
    """Finds a thing by its id; a region whatever it was taken for when it got its number."""
    region = atlas.rooms.find_region(place_id)
    if region is not None:
        return Place(region.id, region)
    if place_id.startswith("T"):
        remembered = atlas.recollection.find_thing(place_id)
        return None if remembered is None else Place(remembered.id, remembered)
    things: list[Door | Frontier | RememberedPlace] = [
        *atlas.rooms.doors,
        *atlas.frontiers.frontiers,
        *atlas.places,
    ]
    return next((Place(thing.id, thing) for thing in things if thing.id == place_id), None)


def _find_by_name(atlas: Atlas, name: str) -> Place | None:
    wanted = name_key(name)
    named = [each for each in atlas.places if name_key(each.waypoint.name) == wanted]
    if len(named) > 1:
        ids = ", ".join(
            f"{each.id} at {say_spot(each.waypoint.pose.point)}" for each in named[:MOST_NAMED]
        )
        raise AmbiguousPlaceError(
            f"{len(named)} remembered places are called {name[:80]!r}.",
            hint=f"They are {ids}; give the id of the one that is meant.",
            words=name,
            meanings=[each.id for each in named],
        )
    return Place(name, named[0]) if named else None


def _read_spot(atlas: Atlas, words: str) -> Place | None:
    if words.casefold() in ROBOT_NAMES:
        return Place("robot", Spot(atlas.robot.point, atlas.robot.yaw_rad))
    match = SPOT.fullmatch(words)
    if match is None:
        return None
    point = Point(float(match["x"]), float(match["y"]))
    yaw_deg = match["yaw_deg"]
    yaw_rad = None if yaw_deg is None else wrap_angle(math.radians(float(yaw_deg)))
    return Place(say_spot(point), Spot(point, yaw_rad))


def _what_became_of(atlas: Atlas, place: str) -> str:
    gone = next((each for each in atlas.rooms.vanished if each.id == place.upper()), None)
    if gone is not None and gone.became:
        return f"{gone.id} is no longer found: its floor is now {' and '.join(gone.became)}."
    if gone is not None:
        return f"{gone.id} is no longer found on the map."
    if re.fullmatch(r"[Ff]\d+", place) and 1 <= int(place[1:]) <= atlas.frontiers.n_named:
        return f"Frontier {place.upper()} is gone: what lay behind it has been seen or refused."
    if re.fullmatch(r"[Tt]\d+", place) and 1 <= int(place[1:]) <= atlas.recollection.n_named:
        return f"The thing {place.upper()} is no longer remembered."
    return f"There is no place called {place[:80]!r}."


def _known_places(atlas: Atlas, wanted: str) -> str:
    if atlas.places and not ID.fullmatch(wanted):
        answer = atlas.recollection.find(wanted, limit=MOST_GUESSES)
        if answer.verdict is not Verdict.NOT_REMEMBERED:
            return _say_guesses(answer)
    groups = {
        "rooms and corridors": [region.id for region in atlas.rooms.regions],
        "doors": [door.id for door in atlas.rooms.doors],
        "frontiers": [frontier.id for frontier in atlas.frontiers.frontiers],
        "remembered": [place.id for place in atlas.places],
    }
    known = [f"{name} {_some_of(ids)}" for name, ids in groups.items() if ids]
    return f"Known are {'; '.join(known) or 'no places yet'}. Call look_at_map to see them."


def _say_guesses(answer: Answer) -> str:
    """Names what may be meant, for the reader to confirm: a likeness alone is no goal."""
    first = answer.candidates[0]
    by = "meaning" if first.basis is Basis.MEANING else "words"
    told = ", ".join(f"{each.entry.id} {quote_name(each.entry.name)}" for each in answer.candidates)
    return (
        f"Nothing remembered is called so; nearest in {by}: {told}. If {first.entry.id} is meant, "
        f"use {first.entry.id}; find_place says more."
    )


def _some_of(ids: list[str]) -> str:
    shown = " ".join(ids[:MOST_NAMED])
    return shown if len(ids) <= MOST_NAMED else f"{shown} and {len(ids) - MOST_NAMED} more"
