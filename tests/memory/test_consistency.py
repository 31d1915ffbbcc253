import math
from dataclasses import replace

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.memory.consistency.checking import check_memory
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding, judge_trust
from mapspeak.memory.things.finding import Things, find_things
from mapspeak.spatial.paths import distances_from
from mapspeak.spatial.rooms import find_rooms

HALL = """
    #########################???????????
    #...........#...........????????????
    #...........#...........????????????
    #...........#...........????????????
    #...........#...........#???
    #...........#...........#???
    #...........#...........#???
    #.......................#???
    #.......................#???
    #.......................#???
    #...........#...........#???
    #########################???
"""
GRID = grid_from_text(HALL, resolution_m=0.25)


def place(
    name: str,
    x: float,
    y: float,
    *landmarks: Landmark,
    yaw_deg: float = 90.0,
    map_id: str | None = None,
    room_id: str | None = None,
) -> Waypoint:
    return Waypoint(
        name=name,
        pose=Pose(x, y, math.radians(yaw_deg)),
        functional_landmarks=landmarks,
        map_id=map_id,
        room_id=room_id,
    )


def mark(label: str, bearing_deg: float = 0.0, range_m: float | None = None) -> Landmark:
    return Landmark(label=label, bearing_rad=math.radians(bearing_deg), range_m=range_m)


def check(*places: Waypoint, map_id: str | None = None) -> tuple[Things, tuple[MemoryFinding, ...]]:
    memory = SemanticMap(map_id=map_id, waypoints=places)
    found = find_things(memory, GRID)
    distances = distances_from(GRID, Point(1.0, 1.0), radius_m=0.2)
    rooms = find_rooms(GRID)
    return found, check_memory(memory, found, distances=distances, rooms=rooms)


def kinds(*places: Waypoint, map_id: str | None = None) -> list[FindingKind]:
    return [finding.kind for finding in check(*places, map_id=map_id)[1]]


def test_a_good_record_has_no_findings() -> None:
    assert kinds(place("a", 1.5, 1.5, mark("sink"))) == []


def test_a_pose_is_judged_by_the_map_as_it_is_now() -> None:
    assert kinds(place("a", 90.0, 1.0)) == [FindingKind.OFF_MAP]
    assert kinds(place("a", 0.1, 1.0)) == [FindingKind.IN_OBSTACLE]
    assert kinds(place("a", 6.9, 0.4)) == [FindingKind.IN_UNKNOWN]
    assert kinds(place("a", 0.3, 0.3)) == []
    assert kinds(place("a", 1e300, 1e300)) == [FindingKind.OFF_MAP]


def test_a_place_that_the_robot_cannot_get_to_is_said_with_its_radius() -> None:
    memory = SemanticMap(waypoints=(place("a", 1.0, 1.5),))
    distances = distances_from(GRID, Point(1.0, 1.0), radius_m=3.0)
    (finding,) = check_memory(memory, find_things(memory, GRID), distances=distances)
    assert finding.kind is FindingKind.UNREACHABLE
    assert finding.radius_m == 3.0


def test_a_record_of_another_map_is_marked() -> None:
    assert kinds(place("a", 1.5, 1.5, map_id="old"), map_id="new") == [FindingKind.OTHER_MAP]
    assert kinds(place("a", 1.5, 1.5, map_id="new"), map_id="new") == []


def test_a_range_beyond_the_wall_is_told_with_both_distances() -> None:
    _, (finding,) = check(place("a", 1.5, 2.0, mark("sink", 90.0, 9.0)))
    assert finding.kind is FindingKind.BEHIND_WALL
    assert finding.told_m == 9.0
    assert finding.label == "sink"


def test_a_line_that_leaves_the_seen_floor_is_told() -> None:
    assert kinds(place("a", 4.0, 2.4, mark("sink"), yaw_deg=0.0)) == [FindingKind.THROUGH_UNKNOWN]


def test_what_is_seen_on_furniture_is_not_told_to_lie_in_the_unknown_inside_it() -> None:
    hall = """
        ####################
        #..................#
        #............#?????#
        #............#?????#
        #............#?????#
        #............#?????#
        #............#?????#
        #............#?????#
        #..................#
        ####################
    """
    grid = grid_from_text(hall, resolution_m=0.1)
    memory = SemanticMap(waypoints=(place("a", 0.5, 0.5, mark("coffee machine"), yaw_deg=0.0),))
    assert check_memory(memory, find_things(memory, grid)) == ()


def test_two_places_with_one_pose_and_content_are_twins() -> None:
    twin = place("b", 1.6, 1.5, mark("Sink"))
    findings = check(place("a", 1.5, 1.5, mark("sink")), twin)[1]
    assert [finding.kind for finding in findings] == [FindingKind.DUPLICATE]
    assert findings[0].waypoints == ("a", "b")


def test_two_names_in_one_place_are_both_shown() -> None:
    one = place("a", 1.5, 0.8, mark("fridge"))
    other = place("b", 1.5, 1.6, mark("cabinet"))
    _, (finding,) = check(one, other)
    assert finding.kind is FindingKind.TWO_LABELS
    assert {thing.label for thing in finding.things} == {"fridge", "cabinet"}


def test_an_invented_second_label_costs_both_their_trust_and_the_finding_names_both() -> None:
    fridge = [place(name, x, 0.8, mark("fridge", deg)) for name, x, deg in (("a", 1.0, -14.0),)]
    fridge += [place("b", 2.0, 0.8, mark("fridge", 14.0))]
    ghost = [
        place("c", 1.2, 1.0, mark("wardrobe", -9.0)),
        place("d", 1.8, 1.0, mark("wardrobe", 9)),
    ]
    found, findings = check(*fridge, *ghost)
    (finding,) = (each for each in findings if each.kind is FindingKind.TWO_LABELS)
    assert {thing.label for thing in finding.things} == {"fridge", "wardrobe"}
    for thing in found.things:
        assert thing.confidence_ratio > 0.95
        trust = judge_trust(thing, findings)
        assert trust.ratio < 0.85
        assert finding in trust.findings


def test_views_that_outweigh_an_invented_label_leave_their_thing_its_trust() -> None:
    seen = [
        place(name, x, y, mark("fridge", deg))
        for name, x, y, deg in (
            ("a", 1.0, 0.8, -14.0),
            ("b", 2.0, 0.8, 14.0),
            ("c", 1.5, 0.6, 0.0),
            ("d", 0.8, 1.2, -24.0),
        )
    ]
    found, findings = check(*seen, place("e", 1.5, 1.2, mark("wardrobe")))
    trust = {thing.label: judge_trust(thing, findings).ratio for thing in found.things}
    assert trust["fridge"] > 0.95
    assert trust["wardrobe"] < 0.3


def test_who_names_both_has_seen_two_things() -> None:
    one = place("a", 1.5, 0.8, mark("table"), mark("coffee machine"))
    assert FindingKind.TWO_LABELS not in kinds(one)


def test_what_hangs_on_two_sides_of_a_wall_is_not_in_one_place() -> None:
    one = place("a", 1.0, 2.0, mark("fire extinguisher", range_m=2.0), yaw_deg=0.0)
    other = place("b", 4.8, 2.0, mark("first-aid box", range_m=1.5), yaw_deg=180.0)
    found, findings = check(one, other)
    extinguisher, box = (thing.position or Point(math.nan, 0.0) for thing in found.things)
    assert extinguisher.distance_to(box) < 0.5
    assert FindingKind.TWO_LABELS not in [finding.kind for finding in findings]


def test_what_somebody_looked_at_and_did_not_name_is_a_weak_finding() -> None:
    seen = (
        place("a", 1.0, 0.8, mark("sink", -11.0)),
        place("b", 2.0, 0.8, mark("sink", 14.0)),
    )
    looked = place("c", 1.5, 1.2, mark("door", 40.0), mark("window", -40.0))
    found, findings = check(*seen, looked)
    assert [finding.kind for finding in findings] == [FindingKind.NOT_SEEN]
    trust, before = judge_trust(found.things[0], findings), judge_trust(found.things[0], ())
    assert found.things[0].label == "sink"
    assert trust.ratio < before.ratio
    assert trust.findings == findings
    assert findings[0].waypoints == ("c",)


def test_who_named_a_thing_from_another_spot_of_a_place_did_not_miss_it_there() -> None:
    beside = Pose(0.5, 2.6, math.radians(-60.0))
    sink = replace(mark("sink", 60.0, range_m=1.0), pose=beside)
    assert kinds(place("c", 1.5, 1.2, mark("door", 40.0), mark("window", -40.0), sink)) == []


def test_a_record_filed_under_another_room_is_told() -> None:
    rooms = find_rooms(GRID)
    west = rooms.find_region_at(Point(1.5, 1.5))
    assert west is not None
    assert kinds(place("a", 1.5, 1.5, room_id=west.id)) == []
    others = [region.id for region in rooms.regions if region.id != west.id]
    assert [kinds(place("a", 1.5, 1.5, room_id=other)) for other in others] == [
        [FindingKind.WRONG_ROOM] for _ in others
    ]


def both_rooms() -> tuple[str, str]:
    rooms = find_rooms(GRID)
    found = [rooms.find_region_at(Point(x, 2.0)) for x in (1.5, 4.5)]
    west, east = (region.id for region in found if region is not None)
    return west, east


def test_rooms_that_got_other_ids_are_no_finding() -> None:
    west, east = both_rooms()
    swapped = [
        place("a", 1.0, 1.5, room_id=east),
        place("b", 1.5, 2.2, room_id=east),
        place("c", 5.0, 1.5, room_id=west),
        place("d", 4.5, 2.2),
    ]
    assert FindingKind.WRONG_ROOM not in kinds(*swapped)


def test_records_of_one_room_that_stand_in_another_together_are_no_finding() -> None:
    west, east = both_rooms()
    renamed = [place("a", 1.0, 1.5, room_id=east), place("b", 1.5, 2.2, room_id=east)]
    assert FindingKind.WRONG_ROOM not in kinds(*renamed, place("c", 1.0, 0.6, room_id=west))


def test_one_record_apart_from_the_others_of_its_room_is_told() -> None:
    west, east = both_rooms()
    seen = [
        place("a", 1.0, 1.5, room_id=east),
        place("b", 4.5, 1.5, room_id=east),
        place("c", 5.0, 2.2, room_id=east),
        place("d", 1.2, 0.6, room_id=west),
    ]
    (finding,) = (f for f in check(*seen)[1] if f.kind is FindingKind.WRONG_ROOM)
    assert finding.waypoints == ("a",)


def test_a_border_that_has_moved_a_little_is_no_finding() -> None:
    _, east = both_rooms()
    assert FindingKind.WRONG_ROOM not in kinds(place("a", 2.5, 0.9, room_id=east))


THREE_ROOMS = """
    ################################
    #.........#.........#..........#
    #.........#.........#..........#
    #.........#.........#..........#
    #..............................#
    #..............................#
    #..............................#
    #.........#.........#..........#
    #.........#.........#..........#
    #.........#.........#..........#
    ################################
"""


def test_a_thing_seen_through_two_doors_in_a_row_is_no_finding() -> None:
    grid = grid_from_text(THREE_ROOMS, resolution_m=0.25)
    rooms = find_rooms(grid)
    first = rooms.find_region_at(Point(1.0, 1.4))
    last = rooms.find_region_at(Point(7.0, 1.4))
    assert first is not None
    assert last is not None
    assert first.id != last.id

    def wrong_rooms(*places: Waypoint) -> list[MemoryFinding]:
        memory = SemanticMap(waypoints=places)
        findings = check_memory(memory, find_things(memory, grid), rooms=rooms)
        return [each for each in findings if each.kind is FindingKind.WRONG_ROOM]

    through_doors = place("a", 0.6, 1.4, mark("sink", range_m=6.5), yaw_deg=0, room_id=first.id)
    through_walls = place("a", 0.6, 2.2, mark("sink", range_m=6.5), yaw_deg=0, room_id=first.id)
    assert wrong_rooms(through_doors) == []
    assert all(each.things for each in wrong_rooms(through_walls))


def test_a_thing_is_judged_from_where_it_was_seen_and_not_from_its_records_place() -> None:
    _, east = both_rooms()
    in_west = replace(mark("sink", range_m=1.0), pose=Pose(1.0, 1.4, math.pi))
    assert kinds(place("a", 5.0, 2.4, in_west, room_id=east)) == []


def test_a_thing_that_may_be_on_this_side_of_the_wall_is_no_finding() -> None:
    west, east = both_rooms()
    seen = place("a", 1.0, 2.2, mark("sink", range_m=2.0), yaw_deg=0.0, room_id=west)
    found, findings = check(seen)
    (sink,) = found.things
    beyond = find_rooms(GRID).find_region_at(sink.position or Point(0.0, 0.0))
    assert beyond is not None
    assert beyond.id == east
    assert findings == ()
    further = replace(sink, position=Point(4.5, 2.2), uncertainty_m=0.5)
    memory, rooms = SemanticMap(waypoints=(seen,)), find_rooms(GRID)
    (finding,) = check_memory(memory, replace(found, things=(further,)), rooms=rooms)
    assert finding.kind is FindingKind.WRONG_ROOM


def test_trust_falls_with_every_finding_and_says_why() -> None:
    found, findings = check(place("a", 0.3, 0.3, mark("sink", -20.0), map_id="old"), map_id="new")
    trust = judge_trust(found.things[0], findings)
    assert trust.ratio < found.things[0].confidence_ratio
    (finding,) = trust.findings
    assert finding.kind is FindingKind.OTHER_MAP
    assert finding.ids == ("old", "new")
    assert trust.thing is found.things[0]


def test_however_many_views_agree_a_little_doubt_is_left() -> None:
    sink = Point(1.5, 2.7)
    spots = [Point(0.5 + 0.35 * (i % 6), 0.5 + 0.4 * (i // 6)) for i in range(18)]
    looks = [(at, math.degrees(at.bearing_to(sink))) for at in spots]
    places = [
        place(f"v{i}", at.x, at.y, mark("sink", degrees - 90, at.distance_to(sink)))
        for i, (at, degrees) in enumerate(looks)
    ]
    found, findings = check(*places)
    assert len(found.things[0].supporting) > 10
    assert 0.999 < judge_trust(found.things[0], findings).ratio < 1.0


def test_one_bad_place_of_three_counts_by_a_third() -> None:
    good = [place(name, x, 0.8, mark("sink")) for name, x in (("a", 1.4), ("b", 1.8))]
    bad = place("c", 1.6, 1.2, mark("sink"), map_id="old")
    found, findings = check(*good, bad, map_id="new")
    alone, alone_findings = check(bad, map_id="new")
    lost = judge_trust(found.things[0], ()).ratio - judge_trust(found.things[0], findings).ratio
    alone_lost = (
        judge_trust(alone.things[0], ()).ratio - judge_trust(alone.things[0], alone_findings).ratio
    )
    assert 0 < lost < alone_lost


def test_a_look_from_the_other_side_of_a_wall_says_nothing_of_what_hangs_on_it() -> None:
    room = "#" + "." * 30 + "#" + "." * 30 + "#"
    grid = grid_from_text("\n".join(["#" * 63, *[room] * 24, "#" * 63]), resolution_m=0.1)
    seen = [
        place("a", 1.6, 1.3, mark("fire extinguisher"), yaw_deg=0.0),
        place("b", 2.2, 0.6, mark("fire extinguisher", 41.2), yaw_deg=0.0),
    ]
    behind = place("c", 4.2, 1.3, mark("plant", 20.0), mark("clock", -20.0), yaw_deg=180.0)
    memory = SemanticMap(waypoints=(*seen, behind))
    found = find_things(memory, grid)
    assert "fire extinguisher" in {thing.label for thing in found.things}
    assert check_memory(memory, found) == ()
