"""What a place is called: an id, a remembered name, coordinates, the robot, or a thing."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point, wrap_angle
from mapspeak.memory import SemanticMap, Waypoint, name_key
from mapspeak.places.goalcheck import FARTHEST_M
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

MOST_NAMED = 12
ID = re.compile(r"(?P<letter>[A-Za-z])(?P<number>[0-9]{1,9})")
KIND_ID = re.compile(
    r"(?:the\s+)?"
    r"(?P<kind>room|corridor|hallway|open space|door|frontier|place|waypoint|thing|[RCODFWT])"
    r"[\s-]+(?P<id>[A-Za-z]?[0-9]{1,9})",
    re.IGNORECASE,
)
"""Room 4" is R4, and "room R4" and "r 4" too."""
LETTERS = {"hallway": "C", "place": "W", "waypoint": "W"}
"""Of kinds whose ids do not begin with their own first letter."""
IDS = re.compile(rf"{ID.pattern}(?:(?:\s*,\s*|\s+)(?:and\s+)?[A-Za-z][0-9]{{1,9}})*")
ARTICLE = re.compile(r"(?:the|an?|any|some)\s+", re.IGNORECASE)
REGION_ID = re.compile(r"(?<!\w)[RCO]\d+(?!\w)", re.IGNORECASE)
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
SPOT = re.compile(
    rf"\(?\s*(?:x\s*=?\s*)?(?P<x>{NUMBER})\s*[,; ]\s*(?:y\s*=?\s*)?(?P<y>{NUMBER})"
    rf"(?:\s*[,; ]\s*(?:yaw\s*=?\s*)?(?P<yaw_deg>{NUMBER})(?:\s*deg)?)?\s*\)?"
)
ROBOT_NAMES = ("robot", "here")
START = "start"
"""What the place is called where the robot, or a route, began."""
STARTED = re.compile(
    r"(?:the )?start(?:ing (?:point|place))?|where (?:i|you|we|it|the robot) (?:started|began)",
    re.IGNORECASE,
)
"""What people call it."""


@dataclass(frozen=True, slots=True)
class Spot:
    """A place by its coordinates.

    Attributes:
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
        meanings: Words for each of the things that mean it alone.
    """

    def __init__(
        self,
        message: str,
        *,
        hint: str,
        words: str,
        meanings: Sequence[str],
        step: NextStep | None = None,
    ) -> None:
        super().__init__(message, hint=hint, step=step)
        self.words = words
        self.meanings = tuple(meanings)


def find_named(world: WorldModel, words: str) -> Place | None:
    """Find what is called so: an id, a remembered name, "x, y", "x, y, yaw", or "robot".

    Raises:
        AmbiguousPlaceError: Several remembered places have that name.
    """
    wanted = words.strip()
    place = _find_by_id(world, wanted.upper()) if ID.fullmatch(wanted) else None
    return (
        place
        or _find_by_name(world, wanted)
        or _read_spot(world, wanted)
        or _find_by_number(world, wanted)
    )


def find_renamed(world: WorldModel, words: str) -> dict[str, str]:
    """Return the ids in words that regions have no longer, each with what that is called now."""
    former = world.rooms.former_ids
    ids = dict.fromkeys(each.upper() for each in REGION_ID.findall(words))
    return {each: former[each] for each in ids if each in former}


def is_taken_name(name: str) -> bool:
    """Return True for what is read as no remembered name: "R3", "1, 2", "robot"."""
    words = name.strip()
    is_spot = SPOT.fullmatch(words) is not None
    return ID.fullmatch(words) is not None or is_spot or words.casefold() in ROBOT_NAMES


def say_spot(point: Point) -> str:
    """Return a point as a name for it."""
    is_on_earth = max(abs(point.x), abs(point.y)) < FARTHEST_M
    return f"({point.x:.2f}, {point.y:.2f})" if is_on_earth else f"({point.x:g}, {point.y:g})"


def _find_by_id(world: WorldModel, place_id: str) -> Place | None:
    """Find a thing by its id; a region whatever it was taken for when it got its number."""
    region = world.rooms.find_region(place_id)
    if region is not None:
        return Place(region.id, region)
    if place_id.startswith("T"):
        remembered = world.recollection.find_thing(place_id)
        return None if remembered is None else Place(place_id, world.follow(remembered))
    things: list[Door | Frontier | RememberedPlace] = [
        *world.rooms.doors,
        *world.frontiers.frontiers,
        *world.places,
    ]
    return next((Place(thing.id, thing) for thing in things if thing.id == place_id), None)


def _find_by_number(world: WorldModel, words: str) -> Place | None:
    """Find "room 4", which is R4; of a region its number counts, whatever kind it is called."""
    match = KIND_ID.fullmatch(words)
    if match is None:
        return None
    kind = match["kind"].casefold()
    letter, has_letter = LETTERS.get(kind, kind[0].upper()), match["id"][0].isalpha()
    return _find_by_id(world, match["id"].upper() if has_letter else f"{letter}{match['id']}")


def _find_by_name(world: WorldModel, name: str) -> Place | None:
    wanted = name_key(name)
    named = [each for each in world.places if name_key(each.waypoint.name) == wanted]
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


def _read_spot(world: WorldModel, words: str) -> Place | None:
    if words.casefold() in ROBOT_NAMES:
        return Place("robot", Spot(world.robot.point, world.robot.yaw_rad))
    if STARTED.fullmatch(words):
        spot = Spot(world.start.point, world.start.yaw_rad)
        return Place(START, spot, "where the robot was when this map was first looked at")
    match = SPOT.fullmatch(words)
    if match is None:
        return None
    point, yaw_deg = Point(float(match["x"]), float(match["y"])), float(match["yaw_deg"] or 0.0)
    if not all(map(math.isfinite, (point.x, point.y, yaw_deg))):
        return None
    yaw_rad = None if match["yaw_deg"] is None else wrap_angle(math.radians(yaw_deg))
    return Place(say_spot(point), Spot(point, yaw_rad))


def find_elsewhere(memory: SemanticMap, words: str) -> tuple[Waypoint, ...]:
    """Return the places of other maps that words name, or that name a thing of the words."""
    wanted = name_key(words)
    return tuple(
        place
        for place in memory.elsewhere
        if any(
            _contains_words(wanted, name_key(name))
            for name in (place.name, *(each.label for each in place.landmarks))
        )
    )


def _contains_words(text: str, words: str) -> bool:
    # Most names are not in the text at all, and a pattern for each would take seconds to compile.
    return words in text and bool(re.search(rf"(?<!\w){re.escape(words)}(?!\w)", text))
