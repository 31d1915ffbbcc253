"""From the name of a place to the pose the robot drives to."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum

from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.search.answer import Basis, EntryKind, Verdict
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.places.goalcheck import GoalCheck, check_goal, say_instead, say_refusal
from mapspeak.places.naming import Place, Spot, find_named, is_taken_name, say_spot
from mapspeak.places.relations.relating import find_related, find_several_related
from mapspeak.places.relations.unknown import no_such_place
from mapspeak.places.standing import arrival_pose
from mapspeak.places.things import IN_ROOM, find_thing, find_things, place_of
from mapspeak.places.ways import stand_at
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedThing


def find_place(world: WorldModel, words: str) -> Place:
    """Find what is meant by an id, a remembered name, coordinates, "robot", a relation or a thing.

    A relation is such as "left of W3" or "between D1 and D2"; `mapspeak.places.relations`. A
    thing is meant by its label, such as "fire extinguisher", where nothing else is called so; and
    what `recall` finds to be called so, and has no doubt of, is meant too.

    Raises:
        GoalError: There is no such place, or there are several; the hint says what became of it
            and what there is.
    """
    place = find_named(world, words) or find_related(world, words)
    place = place or _find_remembered(world, name_room(world, words))
    if place is None:
        raise no_such_place(world, words)
    if isinstance(place.thing, RememberedThing) and not place.reason:
        return place_of(world, place.thing, name=place.name)
    return place


def _find_remembered(world: WorldModel, words: str) -> Place | None:
    """Find the one thing that is called so, else what is found to be without a doubt.

    Likeness in meaning or words does not count: the robot never drives to a guess.
    """
    if is_taken_name(words) or len(find_things(world, words)) == 1:
        return find_thing(world, words)
    found = recall(world, RecallQuery(words=words, n=1))
    first = found.candidates[0] if found.verdict is Verdict.FOUND else None
    if first is None or first.match is None or first.match.basis is not Basis.NAME:
        return find_thing(world, words)
    if first.kind is EntryKind.PLACE:
        (place,) = (each for each in world.places if each.id == first.id)
        return Place(words.strip(), place, f"{place.id} {quote_name(place.waypoint.name)}")
    (thing,) = (each for each in world.things if each.id == first.id)
    return place_of(world, thing, name=words.strip())


def name_room(world: WorldModel, words: str) -> str:
    """Return "ladder in R2" for "ladder in the largest room"; other words as they are."""
    match = IN_ROOM.fullmatch(words)
    if match is None or find_named(world, match["room"]) is not None:
        return words
    room = find_related(world, match["room"])
    if room is None or not isinstance(room.thing, Region):
        return words
    return f"{match['label']} in {room.thing.id}"


def find_places(world: WorldModel, words: str) -> tuple[Place, ...]:
    """Find all that words mean: one place, or the several of "all rooms".

    Raises:
        GoalError: There is no such place, or one thing is meant and there are several.
    """
    return find_group(world, words) or (find_place(world, words),)


def find_group(world: WorldModel, words: str) -> tuple[Place, ...]:
    """Find the places of "all rooms" and the like; () for words that mean no group.

    Raises:
        GoalError: There are too few of them.
    """
    return tuple(
        place_of(world, place.thing) if isinstance(place.thing, RememberedThing) else place
        for place in find_several_related(world, words)
    )


class GoalPurpose(StrEnum):
    """What a robot comes to a place for."""

    ARRIVE = "arrive"
    LOOK = "look"
    """To see what lies there and beyond: no heading was asked for."""
    LOOK_INSIDE = "look_inside"
    """To see a room: no heading was asked for."""

    @property
    def is_for_picture(self) -> bool:
        """True where the robot chooses the heading for the sake of a picture."""
        return self in (GoalPurpose.LOOK, GoalPurpose.LOOK_INSIDE)


@dataclass(frozen=True, slots=True)
class CheckedGoal:
    """A pose to drive to, judged against the map.

    Attributes:
        comes_straight_on: No heading was asked for: it is that of the path from the robot.
    """

    place: Place
    pose: Pose
    check: GoalCheck
    comes_straight_on: bool = False
    purpose: GoalPurpose = GoalPurpose.ARRIVE

    @property
    def name(self) -> str:
        """What the place is called, such as "R3" or "(1.20, -3.40)"."""
        return self.place.name

    @property
    def title(self) -> str:
        """What it is called, with how words for it were read: "R3: the largest room"."""
        reason = self.place.reason
        is_named = is_taken_name(self.name) and not isinstance(self.place.thing, Region | Door)
        is_told = reason and not is_named
        return f"{self.name}: {reason}" if is_told else self.name

    @property
    def thing(self) -> RememberedThing | None:
        """The remembered thing that is gone to; None for other goals."""
        return self.place.thing if isinstance(self.place.thing, RememberedThing) else None


def choose_goal(
    world: WorldModel,
    *,
    place: str | None,
    x: float | None,
    y: float | None,
    yaw_deg: float | None,
    as_near: bool = False,
) -> CheckedGoal:
    """Return the pose to drive to for a place or for coordinates, checked against the map.

    Args:
        as_near: Take the nearest pose that works where the place itself does not.

    Raises:
        GoalError: Neither or both were given, there is no such place, or the robot cannot drive
            there; the hint names the nearest pose that would work.
    """
    meant = read_place(world, place=place, x=x, y=y)
    goal = check_place(world, meant, yaw_deg=yaw_deg)
    if as_near and not goal.check.is_ok and goal.check.nearest is not None:
        near = goal.check.nearest
        instead = Place(f"as near to {goal.name} as possible", Spot(near.point, near.yaw_rad))
        goal = check_place(world, instead, yaw_deg=yaw_deg)
    if not goal.check.is_ok:
        has_heading = yaw_deg is not None or _has_heading(meant)
        hint, step = say_instead(goal.check, has_heading=has_heading)
        raise GoalError(say_refusal(goal.name, goal.check), hint=hint, step=step)
    return goal


def read_place(world: WorldModel, *, place: str | None, x: float | None, y: float | None) -> Place:
    """Return the place that was named, or that of the coordinates.

    Raises:
        GoalError: Neither or both were given, or there is no such place.
    """
    if place is not None and x is None and y is None:
        return find_place(world, place)
    if place is None and x is not None and y is not None:
        point = Point(x, y)
        return Place(say_spot(point), Spot(point))
    raise GoalError(
        "A goal is either a place or both x and y.",
        hint="Give place (an id such as R3, or a remembered name), or x and y in metres.",
    )


def check_place(world: WorldModel, place: Place, *, yaw_deg: float | None = None) -> CheckedGoal:
    """Judge the pose in which the robot would stand at a place."""
    pose = stand_at(world, place)
    if yaw_deg is not None:
        pose = Pose(pose.x, pose.y, wrap_angle(math.radians(yaw_deg)))
    check = check_goal(world.grid, world.distances, pose, opened=world.map.open.distances_from)
    is_free = yaw_deg is None and not _has_heading(place)
    if check.nearest is not None and is_free:
        check = replace(check, nearest=arrival_pose(world, check.nearest.point))
    straight_on = is_free and not isinstance(place.thing, Region)
    return CheckedGoal(place, pose, check, straight_on, _purpose_of(place, yaw_deg))


def _purpose_of(place: Place, yaw_deg: float | None) -> GoalPurpose:
    if yaw_deg is None and isinstance(place.thing, Region):
        return GoalPurpose.LOOK_INSIDE
    is_to_look = yaw_deg is None and isinstance(place.thing, Frontier)
    return GoalPurpose.LOOK if is_to_look else GoalPurpose.ARRIVE


def _has_heading(place: Place) -> bool:
    """Return True where it matters how the robot stands there, and not only where."""
    match place.thing:
        case Region() | Door():
            return False
        case Spot(yaw_rad=yaw_rad):
            return yaw_rad is not None
        case _:
            return True
