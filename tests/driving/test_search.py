import json
from pathlib import Path

import pytest

from drawing import grid_from_text
from embedding import ConceptEmbedder
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.search.candidates import CandidateKind, SearchCandidate, find_candidates
from mapspeak.driving.search.evidence import Opinions, find_context_score, speaks_of, weight_of
from mapspeak.driving.search.progress import Budget, SearchProgress, SearchState
from mapspeak.driving.search.searcher import Judgement, Searcher
from mapspeak.driving.search.seenfloor import SeenFloor
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMapStore, Waypoint
from mapspeak.places.relations.choosing import find_place
from mapspeak.places.relations.viewpoints import measure_shown
from mapspeak.robot import Detection
from mapspeak.session import Session
from mapspeak.simulator import World, load_world
from mapspeak.spatial.fieldofview import HALF_VIEW_RAD
from roaming import RoamingRobot, session_of

pytestmark = pytest.mark.anyio

FLAT = {
    "title": "A hall and two rooms; the fridge is in the far one.",
    "start": {"at": [1.0, 1.0]},
    "walls": [
        {"line": [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]},
        {"line": [[0, 2.5], [10, 2.5]]},
        {"line": [[5, 2.5], [5, 6]]},
    ],
    "doors": [{"at": [2.5, 2.5], "width_m": 1.0}, {"at": [7.5, 2.5], "width_m": 1.0}],
    "objects": [
        {"name": "desk", "kind": "desk", "at": [2.5, 5.4], "yaw_deg": -90},
        {"name": "fridge", "kind": "fridge", "at": [9.3, 5.4], "yaw_deg": -90},
    ],
}
NO_BUDGET = Budget()
NOT_SEEN = Judgement(is_seen=False)


class ReportingRobot(RoamingRobot):
    """A robot whose detector reports one thing, straight ahead, wherever it looks."""

    def __init__(self, world: World, *, label: str) -> None:
        super().__init__(world, has_detector=True)
        self._label = label

    async def fetch_detections(self) -> tuple[Detection, ...]:
        return (Detection(label=self._label, confidence_ratio=0.9, bearing_rad=0.0, range_m=2.0),)


@pytest.fixture
def flat(tmp_path: Path) -> World:
    path = tmp_path / "flat.yaml"
    path.write_text(json.dumps(FLAT))
    return load_world(path)


async def _tell_nobody(_report: DriveReport) -> None:
    """Nobody waits for news."""


async def _step(
    robot: RoamingRobot,
    searcher: Searcher,
    thing: str,
    judgement: Judgement = NOT_SEEN,
    budget: Budget = NO_BUDGET,
) -> SearchProgress:
    """Calls until there is a picture to judge, or the search ends."""
    standing = await searcher.advance(thing, judgement, budget, wait_s=25.0, on_trip=_tell_nobody)
    while standing.state is SearchState.DRIVING:
        standing = await searcher.advance(
            thing, Judgement(), budget, wait_s=25.0, on_trip=_tell_nobody
        )
    if standing.state.shows_picture:
        searcher.note_picture(await robot.fetch_picture())
    return standing


async def _search(
    robot: RoamingRobot, searcher: Searcher, thing: str, budget: Budget = NO_BUDGET
) -> list[SearchProgress]:
    """Searches to the end; what the robot's detector reports counts as seen."""
    standings = [await _step(robot, searcher, thing, Judgement(), budget)]
    while not standings[-1].state.is_end and len(standings) < 60:
        labels = {each.label for each in await robot.fetch_detections()}
        judgement = Judgement(is_seen=any(speaks_of(label, thing) for label in labels))
        standings.append(await _step(robot, searcher, thing, judgement, budget))
    return standings


async def test_a_thing_in_a_room_nobody_has_seen_is_found(tmp_path: Path, flat: World) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    standings = await _search(robot, Searcher(session_of(robot, tmp_path)), "a fridge")
    assert standings[-1].state is SearchState.FOUND
    place = robot.simulation.truth.pose_in_world
    assert place.x > 5.0


async def test_a_thing_that_is_not_there_is_not_found_and_all_rooms_were_seen(
    tmp_path: Path, flat: World
) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    standings = await _search(robot, Searcher(session_of(robot, tmp_path)), "forklift")
    last = standings[-1]
    assert last.state is SearchState.NOT_FOUND
    assert last.seen_ratio > 0.8
    assert len(last.regions) == 3
    assert all(region.seen_ratio > 0.6 for region in last.regions)


async def test_no_place_is_looked_at_twice(tmp_path: Path, flat: World) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    standings = await _search(robot, Searcher(session_of(robot, tmp_path)), "forklift")
    poses = [each.pose for each in standings if each.state is SearchState.LOOK]
    for index, pose in enumerate(poses):
        for other in poses[:index]:
            is_near = pose.point.distance_to(other.point) < 0.2
            assert not (is_near and abs(pose.yaw_deg - other.yaw_deg) < 8)


async def test_ways_to_what_comes_next_are_told_from_where_the_robot_looks(
    tmp_path: Path, flat: World
) -> None:
    robot = RoamingRobot(flat, has_detector=False)
    session = session_of(robot, tmp_path)
    searcher = Searcher(session)
    told = []
    for _ in range(5):
        standing = await _step(robot, searcher, "forklift")
        world = await session.fetch_world_model()
        told += [(each.path_m, world.path_m(each.pose.point)) for each in standing.next]
    assert told
    assert all(way_m is None or abs(path_m - way_m) < 0.3 for path_m, way_m in told)


async def test_a_remembered_place_that_speaks_of_the_thing_comes_first(
    tmp_path: Path, flat: World
) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    session = session_of(robot, tmp_path)
    session.memory.write(
        Waypoint(name="far end", pose=Pose(7.0, 0.0, 0.0), description="a fridge behind the door")
    )
    first = await _step(robot, Searcher(session), "fridge", Judgement())
    assert first.here is not None
    assert first.here.kind is CandidateKind.REMEMBERED
    assert first.pose.point.distance_to(Point(7.0, 0.0)) < 0.3


async def test_a_remembered_thing_is_looked_at_from_where_the_robot_faces_it(
    tmp_path: Path, flat: World
) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    session = session_of(robot, tmp_path)
    fridge = Landmark(label="blue fridge", bearing_rad=0.0, range_m=5.0)
    session.memory.write(
        Waypoint(name="far end", pose=Pose(0.5, 0.0, 0.0), functional_landmarks=(fridge,))
    )
    first = await _step(robot, Searcher(session), "fridge", Judgement())
    assert first.here is not None
    assert (first.here.kind, first.here.id) == (CandidateKind.REMEMBERED, "T1")
    # Seen once and from afar, it is looked for from where most of where it may be is in view.
    world = await session.fetch_world_model()
    goal = find_place(world, "T1")
    assert (measure_shown(world, goal, first.pose, HALF_VIEW_RAD) or 0.0) > 0.8
    far_m = [first.pose.point.distance_to(goal.point), Pose(0.5, 0.0).point.distance_to(goal.point)]
    assert far_m[0] < far_m[1]


async def test_each_place_that_names_the_thing_is_looked_at_once(
    tmp_path: Path, flat: World
) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    session = session_of(robot, tmp_path)
    for x in (4.0, 7.0):
        place = Waypoint(name=f"at {x}", pose=Pose(x, 0.0), description="The forklift parks here.")
        session.memory.write(place)
    standings = await _search(robot, Searcher(session), "forklift")
    looked = [each.here.id for each in standings if each.state is SearchState.LOOK and each.here]
    assert looked[:2] == ["W1", "W2"]
    assert not {"W1", "W2"} & {*looked[2:]}


async def test_what_only_resembles_the_thing_makes_its_surroundings_likelier(
    tmp_path: Path, flat: World
) -> None:
    memory = SemanticMapStore(tmp_path / "semantic_map.yaml")
    session = Session(RoamingRobot(flat), memory, lease_s=60.0, find_model=ConceptEmbedder)
    for name, x in (("sink ladder", 6.5), ("cooler shelf", 6.0)):
        session.memory.write(Waypoint(name=name, pose=Pose(x, 2.5)))
    world_model = await session.fetch_world_model()
    found = find_candidates(
        world_model, "wash", seen=SeenFloor(), opinions=Opinions(), visited=frozenset()
    )
    assert CandidateKind.REMEMBERED not in {each.kind for each in found}
    assert max(each.score for each in found) == 0.8


async def test_a_session_that_was_warmed_embeds_nothing_but_the_first_question(
    tmp_path: Path, flat: World
) -> None:
    embedder = ConceptEmbedder()
    memory = SemanticMapStore(tmp_path / "semantic_map.yaml")
    session = Session(RoamingRobot(flat), memory, lease_s=60.0, find_model=lambda: embedder)
    memory.write(Waypoint(name="sink ladder", pose=Pose(6.5, 2.5)))
    await session.warm_memory()
    n_before = len(embedder.asked)
    world_model = await session.fetch_world_model()
    world_model.recollection.find("thirsty")
    assert embedder.asked[n_before:] == ["thirsty"]


async def test_the_models_scores_lead_the_search(tmp_path: Path, flat: World) -> None:
    world_model = await session_of(RoamingRobot(flat), tmp_path).fetch_world_model()

    def frontiers_by(opinions: Opinions) -> list[str]:
        found = find_candidates(
            world_model, "fridge", seen=SeenFloor(), opinions=opinions, visited=frozenset()
        )
        return [each.id for each in found if each.kind is CandidateKind.FRONTIER]

    neutral = frontiers_by(Opinions())
    assert len(neutral) > 1
    opinions = Opinions()
    opinions.add_scores({neutral[-1]: 1.0, **dict.fromkeys(neutral[:-1], 0.0)})
    assert frontiers_by(opinions)[0] == neutral[-1]


@pytest.mark.parametrize(("label", "likelier"), [("coffee machine", True), ("desk", False)])
async def test_what_the_detector_reports_on_the_way_tells_where_the_thing_may_be(
    tmp_path: Path, flat: World, label: str, likelier: object
) -> None:
    robot = ReportingRobot(flat, label=label)
    searcher = Searcher(session_of(robot, tmp_path))
    scores: set[float] = set()
    for _ in range(4):
        standing = await _step(robot, searcher, "fridge", Judgement())
        scores |= {each.score for each in standing.next}
    assert scores - {0.5}
    assert all((score > 0.5) is likelier for score in scores - {0.5})


async def test_a_remembered_kitchen_is_likelier_to_have_a_fridge_than_the_other_rooms(
    tmp_path: Path, flat: World
) -> None:
    robot = RoamingRobot(flat)
    session = session_of(robot, tmp_path)
    kitchen = Point(6.5, 2.5)
    session.memory.write(Waypoint(name="kitchen", pose=Pose(kitchen.x, kitchen.y)))
    first = await _step(robot, Searcher(session), "fridge", Judgement())
    by_nearness = sorted(first.next, key=lambda each: _looked_at(each).distance_to(kitchen))
    assert by_nearness[0].score > 0.55
    assert by_nearness[0].score > by_nearness[-1].score


def _looked_at(candidate: SearchCandidate) -> Point:
    return candidate.frontier.anchor if candidate.frontier else candidate.pose.point


async def test_a_search_ends_when_its_budget_is_spent(tmp_path: Path, flat: World) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    searcher = Searcher(session_of(robot, tmp_path))
    standings = await _search(robot, searcher, "forklift", Budget(n_looks=2))
    assert standings[-1].state is SearchState.BUDGET_SPENT
    assert standings[-1].n_looks == 2


async def test_what_the_detector_reports_wrongly_is_not_shown_for_ever(
    tmp_path: Path, flat: World
) -> None:
    robot = RoamingRobot(flat, has_detector=True)
    searcher = Searcher(session_of(robot, tmp_path))
    standing = await _step(robot, searcher, "desk", Judgement())
    n_reports = 0
    while not standing.state.is_end and n_reports < 10:
        n_reports += standing.state is SearchState.REPORTED
        standing = await _step(robot, searcher, "desk", NOT_SEEN)
    assert standing.state is SearchState.NOT_FOUND
    assert n_reports < 5


async def test_a_stop_ends_the_search(tmp_path: Path, flat: World) -> None:
    robot = RoamingRobot(flat)
    session = session_of(robot, tmp_path)
    searcher = Searcher(session)
    for _ in range(8):
        standing = await searcher.advance(
            "sofa", NOT_SEEN, NO_BUDGET, wait_s=1.0, on_trip=_tell_nobody
        )
        if standing.state is SearchState.DRIVING:
            break
        searcher.note_picture(await robot.fetch_picture())
    await session.drives.stop()
    stopped = await searcher.advance("sofa", NOT_SEEN, NO_BUDGET, wait_s=5, on_trip=_tell_nobody)
    assert stopped.state is SearchState.INTERRUPTED


def test_a_camera_sees_neither_behind_walls_nor_beside_itself() -> None:
    grid = grid_from_text(
        """
        ##########
        #....#...#
        #....#...#
        #....#...#
        ##########
        """,
        resolution_m=0.5,
    )
    seen = SeenFloor()
    seen.add(Pose(0.75, 1.25, 0.0), 1.0)
    mask = seen.mask_on(grid)
    assert mask[2, 4]
    assert not mask[2, 6]
    assert not mask[1, 1]


@pytest.mark.parametrize(
    ("words", "thing", "speaks"),
    [
        ("fire extinguisher", "extinguisher", True),
        ("office chair", "chairs", True),
        ("sofa", "fridge", False),
        ("", "fridge", False),
    ],
)
def test_words_speak_of_a_thing_by_the_rules_of_the_memory(
    words: str, thing: str, speaks: object
) -> None:
    assert speaks_of(words, thing) is speaks


@pytest.mark.parametrize(
    ("words", "thing", "score"),
    [
        ("coffee machine", "a fridge", 0.8),
        ("toilets", "the fridge", 0.3),
        ("sink", "fridge", 0.55),
        ("coffee table", "coffee machine", 0.3),
        ("fire extinguisher", "fridge", None),
        ("desk", "robot", None),
    ],
)
def test_things_are_likely_near_what_belongs_to_the_same_room(
    words: str, thing: str, score: float | None
) -> None:
    assert find_context_score(words, thing) == (score and pytest.approx(score))


def test_what_the_model_says_of_a_view_counts_more_than_what_stands_there() -> None:
    opinions = Opinions()
    assert opinions.add_context(Point(0.0, 0.0), 0.8)
    assert not opinions.add_context(Point(0.5, 0.0), 0.8)
    assert opinions.score_at(Point(0.0, 0.0), ids=()) == pytest.approx(0.65)
    opinions.add_view(Point(0.0, 0.0), 0.0)
    assert opinions.score_at(Point(0.0, 0.0), ids=()) < 0.5


async def test_what_the_detector_reports_where_the_robot_has_arrived_is_told_as_reported(
    tmp_path: Path, flat: World
) -> None:
    robot = ReportingRobot(flat, label="fridge")
    searcher = Searcher(session_of(robot, tmp_path))
    for _ in range(4):
        standing = await _step(robot, searcher, "fridge", Judgement())
        assert standing.state is SearchState.REPORTED


@pytest.mark.parametrize("region_id", ["R1", "C1", "O1"])
def test_rooms_corridors_and_open_spaces_take_scores(region_id: str) -> None:
    opinions = Opinions()
    opinions.add_scores({region_id: 0.9})
    assert opinions.speaks_of_rooms


def test_a_view_says_something_about_what_is_near_it_and_an_id_says_more() -> None:
    opinions = Opinions()
    opinions.add_view(Point(0.0, 0.0), 1.0)
    near = opinions.score_at(Point(1.0, 0.0), ids=("F1",))
    assert near > 0.7
    assert opinions.score_at(Point(30.0, 0.0), ids=("F1",)) == 0.5
    opinions.add_scores({"f1": 0.1})
    assert opinions.score_at(Point(1.0, 0.0), ids=("F1",)) == 0.1
    assert weight_of(0.5) == 1.0
    assert weight_of(1.0) == pytest.approx(4.0)
