from collections.abc import Iterator
from dataclasses import replace

import pytest

from embedding import ConceptEmbedder
from fakes import two_rooms
from mapspeak.geometry import Point
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.places.asking import Recall, RecallQuery, recall
from mapspeak.server.text.recall import say_advice, say_evidence
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector
from remembering import EXTINGUISHER, LADDER, ROBOT, look, looks_at, world_of

LOOKS = looks_at("fire extinguisher", EXTINGUISHER)
NEAR = look("near", 2.0, 1.0, ("fire extinguisher", LADDER), yaw_deg=180)
THIRD = look("east c", 4.8, 1.5, ("fire extinguisher", EXTINGUISHER), range_m=2.6)
UNPLACED = Waypoint(
    name="hall", pose=ROBOT, functional_landmarks=(Landmark(label="fire extinguisher"),)
)
WASHBASINS = (
    look("far", 2.0, 1.0, ("washbasin", LADDER), yaw_deg=180, range_m=2.0),
    look("near", 4.8, 1.5, ("washbasin", EXTINGUISHER), range_m=2.6),
)


def ask(*places: Waypoint, words: str = "fire extinguisher") -> Recall:
    return recall(world_of(*places), RecallQuery(words=words))


def list_answers() -> Iterator[tuple[Recall, str]]:
    yield ask(*LOOKS), 'Found: T1 "fire extinguisher". navigate_to takes T1.'
    yield ask(LOOKS[0]), "wall or furniture there. navigate_to takes T1. Look before"
    yield ask(UNPLACED), "not sure: where it is was not noted. navigate_to T1 goes where it was"
    yield ask(*LOOKS, words="a helicopter"), "Look for it with search_for."
    yield ask(), "Not remembered: nothing is remembered yet. Look for it with search_for."
    yield ask(*LOOKS, NEAR), "Several: 2 are called so; T2 is the nearest by path. Choose by room"
    yield ask(*LOOKS, THIRD, NEAR), " 1 other is called so, of which fewer views agree."
    yield ask(*WASHBASINS, words="where can I wash my hands"), "Several: 2 are such a thing; T"
    yield ask(*LOOKS, words="a piano"), 'Not remembered (it sounds like "piano", and none is)'


@pytest.mark.parametrize(("recalled", "said"), list(list_answers()))
def test_advice_says_the_verdict_and_what_to_do_next(recalled: Recall, said: str) -> None:
    assert said in say_advice(recalled)


def test_a_place_told_by_one_direction_alone_is_called_a_guess_with_its_radius() -> None:
    one, several = ask(LOOKS[0]), ask(*LOOKS)
    off_m = one.candidates[0].uncertainty_m
    assert f"its place is a guess good to {off_m:.1f} m: of one direction" in say_advice(one)
    assert [each.candidates[0].is_guessed for each in (one, several)] == [True, False]


def test_the_nearest_of_several_is_told_with_how_well_its_place_is_known() -> None:
    recalled = ask(*LOOKS, NEAR)
    first, *others = recalled.candidates
    vague = replace(recalled, candidates=(replace(first, uncertainty_m=3.0), *others))
    assert "T2 is the nearest by path, and its place is known to 3.0 m alone." in say_advice(vague)


def test_evidence_is_a_name_with_the_metres_to_where_it_was_asked_for() -> None:
    near = Point(4.0, 1.0)
    first = recall(world_of(*LOOKS), RecallQuery(words="fire extinguisher", near=near)).candidates[
        0
    ]
    away_m = first.position.distance_to(near) if first.position else 0.0
    said = f'called "fire extinguisher"; {away_m:.1f} m from (4.00, 1.00)'
    assert say_evidence(first, near=near) == said


def test_evidence_is_a_likeness_in_meaning() -> None:
    memory, recollector = SemanticMap(waypoints=LOOKS), Recollector(ConceptEmbedder)
    world = WorldModel(two_rooms(), ROBOT, memory, radius_m=0.2, recollector=recollector)
    first = recall(world, RecallQuery(words="burning flames")).candidates[0]
    assert "is like it in meaning" in say_evidence(first)
