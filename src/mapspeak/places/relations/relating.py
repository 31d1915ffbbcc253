"""From words that relate a place to others to the place."""

import math
from dataclasses import replace

import numpy as np

from mapspeak.errors import GoalError
from mapspeak.geometry import Point
from mapspeak.places.naming import Place, find_named
from mapspeak.places.relations.directions import stand_towards
from mapspeak.places.relations.grammar import (
    Away,
    Between,
    Corner,
    End,
    Facing,
    Middle,
    NextTo,
    Relation,
    Several,
    Standing,
    Superlative,
    Towards,
    Turned,
    WallSide,
    parse_relation,
)
from mapspeak.places.relations.outlines import (
    RoomCorner,
    Wall,
    find_corners,
    find_middle,
    find_walls,
    stand_at_end,
    stand_at_wall,
    stand_in_corner,
    stand_in_middle,
)
from mapspeak.places.relations.placement import (
    find_reachable_cells,
    refuse,
    stand,
)
from mapspeak.places.relations.proximity import (
    find_spot_before_door,
    stand_away,
    stand_between,
    stand_facing,
    stand_next_to,
)
from mapspeak.places.relations.referents import (
    Referent,
    find_by_kind,
    find_known,
    find_room_here,
    refer_to,
    refer_to_door,
    refer_to_point,
    stands_at,
)
from mapspeak.places.relations.superlatives import (
    find_several,
    find_superlative,
    require_one,
)
from mapspeak.places.relations.unknown import no_such_place
from mapspeak.places.relations.vocabulary import pattern, plain
from mapspeak.places.standing import find_standing_point, reach_doors
from mapspeak.places.ways import standing_point
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel

MOST_RELATIONS = 4
LONGEST_NAME = 80
DOORS = pattern(r"(?:two )?doors(?: (?:of|in) (?P<room>.+))?")
BESIDE_M = 1.0


def find_related(world: WorldModel, words: str) -> Place | None:
    """Find the place that a relation means, such as "left of W3"; None for other words.

    The place comes with its reason. It can be reached, whatever stands around it; of "the nearest
    door" and the like it is the thing itself.

    Raises:
        GoalError: A name in it means nothing or several things, or nothing fits; the hint says
            what would.
    """
    relation = parse_relation(words)
    if relation is None:
        return find_named(world, plain(words)) or find_by_kind(world, words)
    place = Reader(world).find(words, relation, MOST_RELATIONS - 1)
    if place is None or place.name:
        return place
    return replace(place, name=" ".join(words.split())[:LONGEST_NAME])


def find_several_related(world: WorldModel, words: str) -> tuple[Place, ...]:
    """Return the places of "all rooms", "the two nearest doors"; () for words that mean no group.

    Raises:
        GoalError: There are too few of them.
    """
    relation = parse_relation(words)
    if not isinstance(relation, Several) or find_named(world, plain(words)):
        return ()
    return Reader(world).find_several(relation)


STANDS = {NextTo: stand_next_to, Facing: stand_facing}


class Reader:
    """Reads relations in one state of the map."""

    def __init__(self, world: WorldModel) -> None:
        self._world = world

    def find(self, words: str, relation: Relation, n_left: int) -> Place | None:
        """Return the place that words mean, without a name where it is one to stand at.

        `n_left` more relations may stand inside it. None where nothing has the name in an order.
        """
        match relation:
            case Superlative(to=to):
                start = None if to is None else self._refer(to, n_left)
                return find_superlative(self._world, relation, start)
            case Several():
                found = self.find_several(relation)
                return require_one(words, found) if found else None
            case _:
                return self._stand(relation, n_left)

    def _require(self, words: str, relation: Relation, n_left: int) -> Place:
        place = self.find(words, relation, n_left)
        if place is None:
            raise no_such_place(self._world, words)
        return place

    def _stand(self, relation: Standing, n_left: int) -> Place:
        """Return where the robot stands for a relation."""
        world = self._world
        match relation:
            case Towards():
                place = self._stand_towards(relation, n_left)
            case Away(of=of, away_m=away_m):
                _check_distance(away_m)
                place = stand_away(world, self._refer(of, n_left), away_m)
            case NextTo(of) | Facing(of):
                place = STANDS[type(relation)](world, self._refer(of, n_left))
            case Turned():
                place = self._stand_turned(relation, n_left)
            case Between():
                place = stand_between(world, *self._refer_to_both(relation, n_left))
            case Corner():
                place = stand_in_corner(world, self._find_corners(relation, n_left))
            case WallSide(is_along=is_along):
                walls = self._find_walls(relation, n_left)
                place = stand_at_wall(world, walls, is_along=is_along)
            case Middle(of):
                place = self._stand_in_middle(self._refer(of, n_left))
            case End(of=of):
                place = stand_at_end(world, self._region_of(of, n_left), relation)
        return place

    def find_several(self, relation: Several) -> tuple[Place, ...]:
        """Return the places of a group; () where nothing is called so."""
        at = None if relation.at is None else self._refer(relation.at, MOST_RELATIONS - 2)
        return find_several(self._world, relation, at)

    def _refer(self, words: str, n_left: int) -> Referent:
        """Return what words inside a phrase mean: a name, or another phrase."""
        known = find_known(self._world, words)
        if known is not None:
            return known
        relation = parse_relation(words)
        if relation is None:
            raise no_such_place(self._world, plain(words))
        if n_left == 0:
            raise refuse(
                f"There are more than {MOST_RELATIONS} relations inside each other.",
                else_hint="Drive to one of the inner places first, or give x, y.",
            )
        return self._refer_to_relation(relation, plain(words), n_left - 1)

    def _refer_to_relation(self, relation: Relation, words: str, n_left: int) -> Referent:
        """Return what a phrase is about: the corner itself, say, not where one stands in it."""
        match relation:
            case Superlative():
                return refer_to(self._world, self._require(words, relation, n_left))
            case Corner():
                corner = self._find_corners(relation, n_left)[0]
                return refer_to_point(self._world, corner.name, corner.point, home=corner.region)
            case WallSide():
                return _refer_to_wall(self._find_walls(relation, n_left)[0])
            case Middle(of) if (thing := self._refer(of, n_left)).region is not None:
                name = f"the middle of {thing.name}"
                middle = find_middle(self._world, thing.region)
                return refer_to_point(self._world, name, middle, home=thing.region)
            case _:
                place = self._require(words, relation, n_left)
                return refer_to_point(self._world, f"the place {words}", place.point)

    def _refer_to_both(self, relation: Between, n_left: int) -> tuple[Referent, Referent]:
        """Return the two things of a "between", by the first division of the words that works."""
        both = self._find_both(relation.of) or self._find_both_doors(relation.of)
        if both is not None:
            return both
        fault: GoalError | None = None
        for one, other in relation.ways:
            try:
                return self._refer(one, n_left), self._refer(other, n_left)
            except GoalError as error:
                fault = fault or error
        raise fault or refuse(
            "Between what and what?", else_hint="Say it such as 'between D1 and D2'."
        )

    def _find_both(self, words: str) -> tuple[Referent, Referent] | None:
        """Return the two things of "between the two nearest doors"."""
        found = find_several_related(self._world, words)
        if not found:
            return None
        if len(found) != 2:
            raise refuse(
                f"{words[:LONGEST_NAME]!r} means {len(found)} places.",
                [f"between {found[0].name} and {each.name}" for each in found[1:2]],
            )
        one, other = (refer_to(self._world, place) for place in found)
        return one, other

    def _find_both_doors(self, words: str) -> tuple[Referent, Referent] | None:
        """Return the two doors of "between the doors" and "between the doors of R2"."""
        match = DOORS.fullmatch(plain(words))
        if match is None:
            return None
        words = match["room"]
        room = self._region_of(words, 0) if words else find_room_here(self._world)
        doors = self._world.rooms.doors_of(room)
        if len(doors) != 2:
            ids = ", ".join(door.id for door in doors) or "none"
            raise refuse(
                f"{room.id} has {len(doors)} doors.",
                else_hint=f"Say between which two; they are {ids}.",
            )
        one, other = (refer_to(self._world, Place(door.id, door)) for door in doors)
        return one, other

    def _stand_towards(self, relation: Towards, n_left: int) -> Place:
        _check_distance(relation.away_m)
        thing, viewer = self._refer(relation.of, n_left), relation.seen_from
        seen_from = None if viewer is None else self._refer(viewer, n_left)
        return stand_towards(self._world, thing, relation, seen_from)

    def _stand_in_middle(self, thing: Referent) -> Place:
        if thing.region is None:
            raise refuse(
                f"{thing.name} is not a room or corridor, so it has no middle.",
                [thing.name, f"next to {thing.name}"],
            )
        return stand_in_middle(self._world, thing.region)

    def _stand_looking_back(self, words: str, n_left: int) -> Place:
        """Return where to stand in a room and see the door that the robot comes in by."""
        world, room = self._world, self._region_of(words, n_left)
        reached = reach_doors(world, world.rooms.doors_of(room))
        if not reached:
            works = [room.id] if find_standing_point(world, room) is not None else []
            raise refuse(f"The robot gets through no door of {room.id}.", works)
        _, door, _ = reached[0]
        at, why = find_spot_before_door(world, door, room), f"in {room.id}, facing {door.id}"
        if at is None:
            at = stand_facing(world, refer_to_door(world, door, room)).point
        counted = "its door" if len(reached) == 1 else f"the nearest of its {len(reached)} doors"
        return stand(at, f"{why}, {counted}", at.bearing_to(door.place))

    def _stand_turned(self, relation: Turned, n_left: int) -> Place:
        if relation.to is None:
            return self._stand_looking_back(relation.place, n_left)
        thing = self._refer(relation.to, n_left)
        inner = parse_relation(relation.place)
        if inner is not None and find_known(self._world, relation.place) is None:
            place = self._require(relation.place, inner, n_left)
            point = standing_point(self._world, place)
            why = place.reason.removesuffix(", facing it")
        else:
            at = self._refer(relation.place, n_left)
            point, why = stands_at(self._world, at), at.name
        if point.distance_to(thing.anchor) < self._world.radius_m:
            raise refuse(f"{relation.place} is where {thing.name} is: it cannot be faced there.")
        return stand(point, f"{why}, facing {thing.name}", point.bearing_to(thing.anchor))

    def _find_corners(self, relation: Corner, n_left: int) -> tuple[RoomCorner, ...]:
        """Return the corners that may be meant, the best first."""
        near = None if relation.near is None else self._refer(relation.near, n_left)
        if relation.of is not None:
            region = self._region_of(relation.of, n_left)
        else:
            region = (near and near.home) or find_room_here(self._world)
        corners = find_corners(self._world, region, relation.compass)
        if near is not None:
            return tuple(sorted(corners, key=lambda each: _away_m(each.point, near)))
        return tuple(sorted(corners, key=lambda each: self._path_m(each.point)))

    def _find_walls(self, relation: WallSide, n_left: int) -> tuple[Wall, ...]:
        """Return the walls that may be meant, the best first."""
        region = self._region_of(relation.of, n_left)
        walls = find_walls(self._world, region, relation.compass)
        return tuple(sorted(walls, key=lambda each: self._path_m(each.middle)))

    def _region_of(self, words: str, n_left: int) -> Region:
        thing = self._refer(words, n_left)
        if thing.region is None:
            raise refuse(
                f"{thing.name} is not a room or corridor: it has no corners, walls or ends.",
                [f"next to {thing.name}"],
            )
        return thing.region

    def _path_m(self, point: Point) -> float:
        """Return how far it is to the floor beside a point that the robot cannot stand in."""
        floor = find_reachable_cells(self._world, point, BESIDE_M)
        return float(floor.paths_m.min(initial=math.inf))


def _check_distance(away_m: float | None) -> None:
    if away_m is not None and not 0 < away_m < math.inf:
        raise refuse(
            f"{away_m:g} m is not a valid distance.",
            else_hint="Give metres above zero, such as 1.5 m.",
        )


def _away_m(point: Point, thing: Referent) -> float:
    return float(np.hypot(thing.extent[:, 0] - point.x, thing.extent[:, 1] - point.y).min())


def _refer_to_wall(wall: Wall) -> Referent:
    shares = np.linspace(0.0, 1.0, max(math.ceil(wall.length_m / 0.1), 2))[:, None]
    start, end = (np.array([point.x, point.y]) for point in (wall.start, wall.end))
    extent = start + shares * (end - start)
    return Referent(name=wall.name, anchor=wall.middle, extent=extent, home=wall.region)
