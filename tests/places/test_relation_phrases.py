import re
from pathlib import Path

import pytest

from mapspeak.places.relations.grammar import (
    Away,
    Between,
    Corner,
    End,
    Middle,
    Several,
    Superlative,
    Towards,
    Turned,
    WallSide,
    parse_relation,
)
from mapspeak.places.relations.vocabulary import Compass, Kind, Order, Side

REFERENCE = Path(__file__).parents[2] / "docs" / "reference" / "relations.md"


@pytest.mark.parametrize(
    ("words", "relation"),
    [
        ("left of W3", Towards(direction=Side.LEFT, of="W3")),
        ("To the right_of the W3", Towards(direction=Side.RIGHT, of="the W3")),
        ("in_front_of(R4)", Towards(direction=Side.FRONT, of="(R4)")),
        ("1.5 m behind W1", Towards(direction=Side.BEHIND, of="W1", away_m=1.5)),
        ("north-of R1", Towards(direction=Compass.NORTH, of="R1")),
        ("2 metres north east of R1", Towards(direction=Compass.NORTH_EAST, of="R1", away_m=2.0)),
        ("half a metre south_of W1", Towards(direction=Compass.SOUTH, of="W1", away_m=0.5)),
        ("left of W1 as seen from D2", Towards(direction=Side.LEFT, of="W1", seen_from="D2")),
        (
            "behind W1 as the robot sees it",
            Towards(direction=Side.BEHIND, of="W1", seen_from="robot"),
        ),
        ("250 cm from W3", Away(of="W3", away_m=2.5)),
        ("2.5m away from W3", Away(of="W3", away_m=2.5)),
        ("between D1 and D2", Between((("D1", "D2"),), "D1 and D2")),
        ("between(W1, W2)", Between((("W1", "W2"),), "W1, W2")),
        ("the north-east corner of R2", Corner(of="R2", compass=Compass.NORTH_EAST)),
        ("the corner next to D1", Corner(near="D1")),
        ("corner of R2 near D1", Corner(of="R2", near="D1")),
        ("along the northern wall of R3", WallSide(of="R3", compass=Compass.NORTH, is_along=True)),
        ("centre of R2", Middle("R2")),
        ("the end of C3", End(of="C3")),
        ("at the far end of C3", End(of="C3")),
        ("nearer end of C3", End(of="C3", is_near=True)),
        ("north-east end of C3", End(of="C3", compass=Compass.NORTH_EAST)),
        ("rooms with two doors", Several(kind=Kind.ROOM, n_doors=2)),
        ("all corridors with 4 doors", Several(kind=Kind.CORRIDOR, n_doors=4)),
        ("a room with one door", Several(kind=Kind.ROOM, n_doors=1)),
        ("nearest unexplored area", Superlative(kind=Kind.FRONTIER)),
        ("the closest door to W3", Superlative(kind=Kind.DOOR, to="W3")),
        ("left of W3, facing D1", Turned("left of W3", "D1")),
        ("R2 looking back through D6", Turned("R2", "D6")),
        ("R2, looking back through its door", Turned("R2", None)),
        ("go to R2, look back through its door", Turned("R2", None)),
        ("stand between D1 and D2", Between((("D1", "D2"),), "D1 and D2")),
        ("R2 facing its doorway", Turned("R2", None)),
        (
            "the second-largest room",
            Superlative(kind=Kind.ROOM, order=Order.LARGEST, rank=2),
        ),
        ("furthest door from W3", Superlative(kind=Kind.DOOR, order=Order.FARTHEST, to="W3")),
        ("the two nearest doors", Several(kind=Kind.DOOR, count=2)),
        (
            "3 largest rooms",
            Several(kind=Kind.ROOM, order=Order.LARGEST, count=3),
        ),
        ("all of the rooms", Several(kind=Kind.ROOM)),
        ("every door of C1", Several(kind=Kind.DOOR, at="C1")),
        ("doors of C1", Several(kind=Kind.DOOR, at="C1")),
        ("the doors into C1", Several(kind=Kind.DOOR, at="C1")),
        ("every remembered fire extinguisher", Several(label="fire extinguisher")),
    ],
)
def test_a_phrase_is_read_whatever_its_articles_case_and_underscores(
    words: str, relation: object
) -> None:
    assert parse_relation(words) == relation
    assert parse_relation(words.upper()) is not None


@pytest.mark.parametrize("words", ["", "W3", "left", "the moon", "north", "in the north of R1"])
def test_other_words_are_no_relation(words: str) -> None:
    assert parse_relation(words) is None


def test_every_phrase_of_the_reference_is_understood() -> None:
    rows = [line.split("|")[1] for line in REFERENCE.read_text().splitlines() if line[:3] == "| `"]
    phrases = [phrase for row in rows for phrase in re.findall(r"`([^`]+)`", row)]
    assert len(phrases) > 20
    assert [phrase for phrase in phrases if parse_relation(phrase) is None] == []


def test_the_sign_of_a_coordinate_is_no_hyphen() -> None:
    relation = parse_relation("left of -1, -2")
    assert relation == Towards(direction=Side.LEFT, of="-1, -2")


@pytest.mark.parametrize("filler", ["the ", "_", "- ", "left of ", "between "])
def test_a_very_long_text_is_no_phrase(filler: str) -> None:
    assert parse_relation("left of " + filler * 20_000) is None
