import pytest

from mapspeak.geometry import Pose
from mapspeak.semantic import (
    Landmark,
    MatchField,
    MatchKind,
    SemanticMap,
    Waypoint,
    WaypointMatch,
    find_waypoints,
)

HERE = Pose(0.0, 0.0)
PLACES = SemanticMap(
    waypoints=(
        Waypoint(
            name="loading dock",
            pose=HERE,
            description="A wide hall with a grey floor.",
            safety_landmarks=(Landmark(label="fire extinguisher"),),
            functional_landmarks=(Landmark(label="pallet rack", purpose="storing goods"),),
            geometric_features=("corner of two walls",),
        ),
        Waypoint(
            name="kitchen",
            pose=HERE,
            description="A small room beside the hall.",
            functional_landmarks=(
                Landmark(label="coffee machine"),
                Landmark(label="sink", purpose="washing hands", note="cold water only"),
            ),
        ),
        Waypoint(
            name="charging corner",
            pose=HERE,
            safety_landmarks=(Landmark(label="exit sign"), Landmark(label="fire extinguisher")),
        ),
    )
)


def found(query: str) -> list[str]:
    return [match.waypoint.name for match in find_waypoints(PLACES, query)]


def first(query: str) -> WaypointMatch:
    return find_waypoints(PLACES, query)[0]


@pytest.mark.parametrize(
    ("query", "name"),
    [
        ("loading dock", "loading dock"),
        ("go to the Loading Dock, please", "loading dock"),
        ("coffee", "kitchen"),
        ("where can I wash my hands", "kitchen"),
        ("a charger", "charging corner"),
        ("exit signs", "charging corner"),
        ("pallets", "loading dock"),
        ("somewhere with water", "kitchen"),
        ("cofee mashine", "kitchen"),
        ("KÍTCHEN", "kitchen"),
    ],
)
def test_the_place_that_people_mean_comes_first(query: str, name: str) -> None:
    assert found(query)[0] == name


def test_a_name_alone_is_a_sure_match() -> None:
    match = first(" Charging  CORNER")

    assert match.score_ratio == 1.0
    assert match.evidence[0].field is MatchField.NAME


def test_evidence_says_which_word_stands_where_and_how_it_matched() -> None:
    match = first("washing the hand")

    assert [(e.query_word, e.found_word, e.field, e.kind) for e in match.evidence] == [
        ("washing", "washing", MatchField.PURPOSE, MatchKind.SAME),
        ("hand", "hands", MatchField.PURPOSE, MatchKind.FORM),
    ]
    assert match.evidence[0].text == "washing hands"


def test_a_misspelt_word_scores_less_and_says_so() -> None:
    right, wrong = first("fire extinguisher"), first("fire extinguihser")

    assert wrong.waypoint == right.waypoint
    assert wrong.score_ratio < right.score_ratio
    assert [e.kind for e in wrong.evidence] == [MatchKind.SAME, MatchKind.MISSPELT]


def test_a_word_that_the_map_knows_is_not_taken_for_a_misspelt_one() -> None:
    assert found("sink") == ["kitchen"]
    assert found("sign") == ["charging corner"]


def test_a_name_weighs_more_than_a_description() -> None:
    assert found("hall") == ["loading dock", "kitchen"]
    with_hall = SemanticMap(waypoints=(*PLACES.waypoints, Waypoint(name="hall", pose=HERE)))
    assert find_waypoints(with_hall, "the hall")[0].waypoint.name == "hall"


@pytest.mark.parametrize(
    "query", ["", "?!", "the", "where is it", "swimming pool", "defibrillator"]
)
def test_nothing_is_found_where_nothing_fits(query: str) -> None:
    assert found(query) == []


def test_an_empty_map_remembers_nothing() -> None:
    assert find_waypoints(SemanticMap(), "kitchen") == ()


def test_equal_matches_keep_the_order_of_the_map_and_the_limit_is_kept() -> None:
    many = SemanticMap(waypoints=tuple(Waypoint(name=f"rack {i}", pose=HERE) for i in range(9)))

    matches = find_waypoints(many, "rack", limit=3)

    assert [match.waypoint.name for match in matches] == ["rack 0", "rack 1", "rack 2"]


def test_words_of_any_script_are_compared() -> None:
    places = SemanticMap(waypoints=(Waypoint(name="소화기 앞", pose=HERE),))

    assert find_waypoints(places, "소화기")[0].waypoint.name == "소화기 앞"
