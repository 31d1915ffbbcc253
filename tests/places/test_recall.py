import math
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from embedding import ConceptEmbedder
from fakes import two_rooms
from mapspeak.errors import ConfigError, GoalError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.memory.search.answer import Basis, EntryKind, Verdict
from mapspeak.places.asking import RecallQuery, leave_out_beside, recall
from mapspeak.places.candidate import RecallDoubt
from mapspeak.places.naming import AmbiguousPlaceError
from mapspeak.places.relations.choosing import check_place, find_place
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing
from remembering import EXTINGUISHER, LADDER, ROBOT, look, looks_at, world_of

LOOKS = looks_at("fire extinguisher", EXTINGUISHER)
WEST = look("west", 2.0, 1.0, ("ladder", LADDER), yaw_deg=180)


def ask(world: WorldModel, words: str, **more: object) -> list[str]:
    answer = recall(world, RecallQuery(words=words, **more))  # type: ignore[arg-type]
    return [each.id for each in answer.candidates]


def test_a_thing_seen_from_several_places_is_one_candidate_with_position_and_goal() -> None:
    answer = recall(world_of(*LOOKS, WEST), RecallQuery(words="fire extinguisher"))
    first = answer.candidates[0]
    assert answer.verdict is Verdict.FOUND
    assert [each.name for each in answer.candidates].count("fire extinguisher") == 1
    assert first.seen_from == ("W1", "W2")
    assert first.position is not None
    assert first.position.distance_to(EXTINGUISHER) < 0.5
    assert first.room_ids == ("R1",)
    assert first.check.path_m is not None
    assert first.is_faced
    assert first.pose.point.distance_to(EXTINGUISHER) <= 1.5
    ahead = first.pose.point.bearing_to(EXTINGUISHER) - first.pose.yaw_rad
    assert abs(math.remainder(ahead, math.tau)) < math.radians(30)
    assert first.match is not None
    assert first.match.basis is Basis.NAME
    assert answer.doubt is None


WAITING = Waypoint(
    name="where visitors wait", description="The place where visitors wait.", pose=ROBOT
)


@pytest.mark.parametrize("words", ["where do visitors wait", "the place where visitors wait"])
def test_what_is_found_for_words_is_a_goal_by_the_same_words(words: str) -> None:
    world = world_of(*LOOKS, WAITING)
    answer = recall(world, RecallQuery(words=words))
    assert answer.verdict is Verdict.FOUND
    place = find_place(world, words)
    assert isinstance(place.thing, RememberedPlace)
    assert place.thing.id == answer.candidates[0].id == "W3"
    assert "where visitors wait" in place.reason


def test_a_thing_may_be_meant_in_a_room_that_words_mean() -> None:
    place = find_place(world_of(*LOOKS, WEST), "fire extinguisher in the largest room")
    assert isinstance(place.thing, RememberedThing)
    with pytest.raises(GoalError):
        find_place(world_of(*LOOKS, WEST), "fire extinguisher in the smallest room")


def test_a_room_word_is_answered_with_no_thing() -> None:
    table = look("west", 2.0, 1.0, ("kitchen table", LADDER), yaw_deg=180)
    world = world_of(table)
    with pytest.raises(GoalError) as caught:
        find_place(world, "cafeteria")
    assert "T1" not in caught.value.hint


def test_a_thing_that_one_view_alone_speaks_of_is_likely_and_not_found() -> None:
    answer = recall(world_of(LOOKS[0]), RecallQuery(words="fire extinguisher"))
    assert answer.verdict is Verdict.LIKELY
    assert answer.doubt is RecallDoubt.FEW_VIEWS


def test_a_thing_whose_direction_nobody_noted_is_likely_where_it_was_seen() -> None:
    place = Waypoint(
        name="hall", pose=ROBOT, functional_landmarks=(Landmark(label="fire extinguisher"),)
    )
    answer = recall(world_of(place), RecallQuery(words="fire extinguisher"))
    assert answer.verdict is Verdict.LIKELY
    assert answer.doubt is RecallDoubt.NOT_NOTED


def test_what_is_not_remembered_is_told_apart_from_an_empty_memory() -> None:
    answer = recall(world_of(*LOOKS), RecallQuery(words="a helicopter"))
    assert answer.verdict is Verdict.NOT_REMEMBERED
    assert not answer.is_empty


def test_an_empty_memory_is_not_remembered_either() -> None:
    answer = recall(world_of(), RecallQuery(words="ladder"))
    assert answer.verdict is Verdict.NOT_REMEMBERED
    assert answer.candidates == ()
    assert answer.is_empty


def test_several_of_one_name_are_ambiguous_and_the_nearest_by_path_comes_first() -> None:
    near = look("near", 2.0, 1.0, ("fire extinguisher", LADDER), yaw_deg=180)
    answer = recall(world_of(*LOOKS, near), RecallQuery(words="fire extinguisher"))
    assert answer.verdict is Verdict.SEVERAL
    assert answer.answer.n_meant == 2
    assert answer.candidates[0].room_ids == ("R2",)


def test_of_several_that_are_as_like_in_meaning_the_nearest_by_path_comes_first() -> None:
    far = look("far", 2.0, 1.0, ("washbasin", LADDER), yaw_deg=180, range_m=2.0)
    near = look("near", 4.8, 1.5, ("washbasin", EXTINGUISHER), range_m=2.6)
    for places in ((far, near), (near, far)):
        world = world_of(*places)
        answer = recall(world, RecallQuery(words="where can I wash my hands"))
        paths_m = [each.check.path_m for each in answer.candidates]
        assert answer.verdict is Verdict.SEVERAL
        assert None not in paths_m
        assert paths_m == sorted(paths_m, key=lambda path_m: path_m or 0.0)


def test_the_one_of_several_that_three_views_agree_on_is_found_and_the_others_are_told() -> None:
    third = look("east c", 4.8, 1.5, ("fire extinguisher", EXTINGUISHER), range_m=2.6)
    near = look("near", 2.0, 1.0, ("fire extinguisher", LADDER), yaw_deg=180)
    answer = recall(world_of(*LOOKS, third, near), RecallQuery(words="fire extinguisher"))
    assert answer.verdict is Verdict.FOUND
    assert answer.answer.n_meant == 2
    assert answer.candidates[0].room_ids == ("R1",)
    assert [each.name for each in answer.candidates[:2]] == ["fire extinguisher"] * 2


def test_two_of_one_name_that_three_views_each_agree_on_stay_ambiguous() -> None:
    third = look("east c", 4.8, 1.5, ("fire extinguisher", EXTINGUISHER), range_m=2.6)
    west = [
        look(f"west {i}", x, y, ("fire extinguisher", LADDER), yaw_deg=180, range_m=range_m)
        for i, (x, y, range_m) in enumerate([(2.0, 1.0, 2.2), (2.6, 2.4, 2.3), (1.0, 0.6, 1.9)])
    ]
    answer = recall(world_of(*LOOKS, third, *west), RecallQuery(words="fire extinguisher"))
    assert answer.verdict is Verdict.SEVERAL


def test_filters_apply_before_ranking() -> None:
    near = look("near", 2.0, 1.0, ("fire extinguisher", LADDER), yaw_deg=180)
    world = world_of(*LOOKS, near)
    in_east = recall(world, RecallQuery(words="fire extinguisher", room_id="R1"))
    assert in_east.verdict is Verdict.FOUND
    assert [each.room_ids for each in in_east.candidates if each.id[0] == "T"] == [("R1",)]
    assert ask(world, "fire extinguisher in R1") == ask(world, "fire extinguisher", room_id="R1")
    assert len(ask(world, "fire extinguisher", near=LADDER, near_m=1.0)) == 1
    assert all(each[0] == "W" for each in ask(world, "fire extinguisher", kind=EntryKind.PLACE))


def test_a_span_of_time_keeps_what_was_last_seen_in_it() -> None:
    noon = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
    world = world_of(replace(LOOKS[0], recorded_at=noon), replace(WEST, recorded_at=None))
    assert ask(world, "fire extinguisher", since=noon)
    assert not ask(world, "fire extinguisher", until=noon)
    assert not ask(world, "ladder", since=noon - timedelta(days=1), kind=EntryKind.THING)


def test_the_answer_is_the_same_every_time() -> None:
    first, second = (recall(world_of(*LOOKS, WEST), RecallQuery(words="fire")) for _ in range(2))
    assert first == second


def test_things_keep_their_ids_when_more_is_seen_and_ids_are_not_given_twice() -> None:
    first = world_of(*LOOKS, WEST)
    ladder = find_place(first, "ladder").thing
    sink = look("sink", 2.5, 2.0, ("sink", Point(2.0, 2.6)), yaw_deg=90)
    more = look("west b", 1.0, 0.8, ("ladder", LADDER), yaw_deg=90)
    second = world_of(*LOOKS, WEST, more, sink, previous=first)
    ids = {each.thing.label: each.id for each in second.things}
    assert ids["ladder"] == getattr(ladder, "id", None)
    assert ids["sink"] == "T3"
    third = world_of(*LOOKS, sink, previous=second)
    fourth = world_of(*LOOKS, sink, look("b", 1.0, 1.0, ("bin", LADDER)), previous=third)
    assert {each.id for each in fourth.things} == {"T1", "T3", "T4"}
    with pytest.raises(GoalError, match="T2 is no longer remembered"):
        find_place(third, "T2")


def test_nothing_is_made_anew_while_memory_and_map_stay() -> None:
    first = world_of(*LOOKS)
    judge = first.judge
    second = world_of(*LOOKS, previous=first)
    assert second.recollection is first.recollection
    assert second.judge is judge


@pytest.mark.parametrize(
    "words", ["fire extinguisher", "T1", "t1", "the Fire Extinguishers", "fire extingisher"]
)
def test_a_thing_is_a_goal_that_faces_it_from_near(words: str) -> None:
    world = world_of(*LOOKS, WEST)
    place = find_place(world, words)
    goal = check_place(world, place)
    assert goal.check.is_ok
    assert goal.pose.point.distance_to(EXTINGUISHER) <= 1.5
    assert "seen from W1 W2" in place.reason


def test_a_remembered_name_wins_over_a_thing_of_that_name() -> None:
    named = Waypoint(name="Ladder", pose=ROBOT)
    assert find_place(world_of(named, WEST), "ladder").point == ROBOT.point


def test_a_label_that_several_things_bear_is_answered_with_ids_rooms_and_ways() -> None:
    near = look("near", 2.0, 1.0, ("fire extinguisher", LADDER), yaw_deg=180)
    world = world_of(*LOOKS, near)
    with pytest.raises(AmbiguousPlaceError, match=r"T\d in R1, \d+\.\d m.*T\d in R2, \d+\.\d m"):
        find_place(world, "fire extinguisher")
    for words in ("nearest fire extinguisher", "the fire extinguisher in R2"):
        assert find_place(world, words).point.distance_to(LADDER) < 0.6
    there = find_place(world, "nearest fire extinguisher to R1")
    assert there.point.distance_to(EXTINGUISHER) < 0.6


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("the fire extinguisher", "called 'fire extinguisher'. .*say 'nearest fire extinguisher'"),
        ("a fire extinguisher in R2", "say 'nearest fire extinguisher in R2'"),
    ],
)
def test_the_advice_for_several_things_of_one_name_can_be_said_as_it_stands(
    words: str, says: str
) -> None:
    near = look("near", 2.0, 1.0, ("fire extinguisher", LADDER), yaw_deg=180)
    other = look("other", 1.0, 1.0, ("fire extinguisher", Point(1.0, 0.2)), yaw_deg=-90)
    world = world_of(*LOOKS, near, other)
    with pytest.raises(AmbiguousPlaceError, match=says) as raised:
        find_place(world, words)
    advised = re.search(r"say '(.+)'\.", str(raised.value))
    assert advised is not None
    assert find_place(world, advised[1]).thing is not None


def test_a_thing_without_a_position_falls_back_to_where_it_was_seen_from() -> None:
    seen = Waypoint(name="a", pose=ROBOT, functional_landmarks=(Landmark(label="sink"),))
    place = find_place(world_of(seen), "sink")
    assert check_place(world_of(seen), place).pose == ROBOT
    assert "the goal is where it was seen from; seen from W1" in place.reason


CHARGER = look("charging end", 1.0, 1.0, ("charging station", LADDER))


def test_a_place_that_saw_the_thing_that_is_meant_is_no_rival_of_it() -> None:
    answer = recall(world_of(CHARGER), RecallQuery(words="place to charge"))
    assert answer.verdict in (Verdict.FOUND, Verdict.LIKELY)
    assert answer.candidates[0].id == "T1"
    assert answer.answer.n_meant == 1


def test_what_only_stands_in_a_place_that_says_a_word_is_left_out_beside_what_is_called_by_it() -> (
    None
):
    kitchen = replace(
        look("kitchen", 2.0, 1.0, ("fridge", LADDER), ("fire hose", EXTINGUISHER)),
        description="A fire blanket hangs here.",
    )
    world = world_of(*LOOKS, kitchen)
    answer = leave_out_beside(recall(world, RecallQuery(words="fire", n=20)))
    assert {each.name for each in answer.candidates} == {"fire extinguisher", "fire hose"}


@pytest.mark.parametrize("words", ["everything seen", "last ten minutes"])
def test_one_word_of_what_a_kind_is_used_for_makes_no_request_sound_like_it(words: str) -> None:
    answer = recall(world_of(*looks_at("meeting table", EXTINGUISHER)), RecallQuery(words=words))
    assert answer.verdict is Verdict.NOT_REMEMBERED
    assert answer.answer.missing is None


@pytest.mark.parametrize(
    ("words", "kind"),
    [("a piano", "piano"), ("where is the vest", "high-visibility vest")],
)
def test_a_kind_that_is_not_remembered_is_named_where_its_name_is_said(
    words: str, kind: str
) -> None:
    assert recall(world_of(*LOOKS), RecallQuery(words=words)).answer.missing == kind


def test_what_is_like_the_words_but_not_called_so_is_named_to_be_confirmed() -> None:
    world = world_of(*looks_at("washbasin", EXTINGUISHER))
    with pytest.raises(GoalError, match=r"nearest in words: T1 \"washbasin\".*use T1"):
        find_place(world, "where can I wash my hands")


def test_what_only_shares_a_word_with_the_words_is_not_named() -> None:
    world = world_of(*looks_at("wall box", EXTINGUISHER))
    assert recall(world, RecallQuery(words="box of matches")).verdict is Verdict.UNSURE
    with pytest.raises(GoalError) as caught:
        find_place(world, "box of matches")
    assert "T1" not in str(caught.value)


def test_of_things_as_like_the_words_the_nearest_is_named_first() -> None:
    words = "where can I wash my hands"
    far = looks_at("washbasin", EXTINGUISHER)
    near = (
        look("near", 1.0, 1.0, ("washbasin", Point(1.5, 0.2))),
        look("near too", 2.0, 1.0, ("washbasin", Point(1.5, 0.2))),
    )
    memory = SemanticMap(waypoints=(*far, *near))
    world = WorldModel(two_rooms(), Pose(6.0, 1.5), memory, radius_m=0.2)
    recalled = recall(world, RecallQuery(words=words))
    nearest = recalled.candidates[0].id
    assert nearest == "T2"
    with pytest.raises(GoalError, match=f"use {nearest}") as caught:
        find_place(world, words)
    assert caught.value.hint.index(nearest) < caught.value.hint.index(recalled.candidates[1].id)
    ways = [each.check.path_m or 0.0 for each in recalled.candidates]
    assert ways == sorted(ways)


def test_what_speaks_against_a_thing_lowers_its_trust() -> None:
    behind = look("a", 2.0, 1.0, ("sink", Point(2.0, 2.6)), yaw_deg=90, range_m=9.0)
    first = recall(world_of(behind), RecallQuery(words="sink")).candidates[0]
    assert first.trust.ratio < 0.8
    assert first.trust.findings


def test_a_likeness_in_meaning_is_told_and_never_driven_to() -> None:
    memory = SemanticMap(waypoints=LOOKS)
    recollector = Recollector(ConceptEmbedder)
    world = WorldModel(two_rooms(), ROBOT, memory, radius_m=0.2, recollector=recollector)
    answer = recall(world, RecallQuery(words="burning flames"))
    assert answer.candidates[0].id == "T1"
    assert answer.answer.candidates[0].basis is Basis.MEANING
    with pytest.raises(GoalError, match="nearest in meaning: T1"):
        find_place(world, "burning flames")


def test_a_warm_memory_embeds_nothing_but_the_first_question() -> None:
    embedder = ConceptEmbedder()
    recollector = Recollector(lambda: embedder)
    memory = SemanticMap(waypoints=LOOKS)

    recollector.warm(memory)
    n_before = len(embedder.asked)
    recall(
        WorldModel(two_rooms(), ROBOT, memory, radius_m=0.2, recollector=recollector),
        RecallQuery(words="burning flames"),
    )

    assert embedder.asked[n_before:] == ["burning flames"]


def test_warming_changes_no_answer() -> None:
    memory, query = SemanticMap(waypoints=LOOKS), RecallQuery(words="burning flames")
    cold, warm = Recollector(ConceptEmbedder), Recollector(ConceptEmbedder)
    warm.warm(memory)

    answers = [
        recall(WorldModel(two_rooms(), ROBOT, memory, radius_m=0.2, recollector=each), query)
        for each in (cold, warm)
    ]

    assert answers[0] == answers[1]


def test_warming_without_a_model_does_nothing() -> None:
    recollector = Recollector()
    recollector.warm(SemanticMap(waypoints=LOOKS))
    assert recollector.embedder is None


def test_what_is_missing_is_told_with_the_verdict() -> None:
    answer = recall(world_of(*LOOKS), RecallQuery(words="a piano"))
    assert answer.verdict is Verdict.NOT_REMEMBERED
    assert answer.answer.missing == "piano"


def test_a_broken_model_costs_no_more_than_the_meanings() -> None:
    def find_broken() -> None:
        raise ConfigError("The model is broken.", hint="Install it again.")

    memory = SemanticMap(waypoints=LOOKS)
    world = WorldModel(
        two_rooms(), ROBOT, memory, radius_m=0.2, recollector=Recollector(find_broken)
    )
    answer = recall(world, RecallQuery(words="fire extinguisher"))
    assert answer.verdict is Verdict.FOUND
    assert answer.answer.limits is not None
