import math
from dataclasses import replace

import pytest

from mapspeak.geometry import Point
from mapspeak.memory import Landmark
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding, Trust
from mapspeak.memory.things.thing import Category, Thing, View
from mapspeak.server.text.findings import say_conflict, say_finding, say_support, say_trust

VIEW = View(
    waypoint="a",
    landmark=Landmark(label="sink", bearing_rad=0.0, range_m=2.0),
    place=Point(0.0, 0.0),
    far_m=2.5,
    off_rad=math.radians(12),
)
SINK = Thing(
    label="sink",
    other_labels=(),
    category=Category.FUNCTIONAL,
    purposes=(),
    position=Point(2.0, 1.0),
    uncertainty_m=0.5,
    supporting=(VIEW,),
    conflicting=(),
    confidence_ratio=0.9,
    n_agreeing=1,
)
STOVE = replace(SINK, label="stove", supporting=(VIEW, replace(VIEW, waypoint="b")))
FINDING = MemoryFinding(kind=FindingKind.OFF_MAP, waypoints=("a",), at=Point(9.0, 1.0))


@pytest.mark.parametrize(
    ("finding", "said"),
    [
        (FINDING, '"a" stands at (9.00, 1.00), off the map.'),
        (
            replace(FINDING, kind=FindingKind.UNREACHABLE, radius_m=0.3),
            '"a" stands at (9.00, 1.00), where a robot of 0.30 m radius cannot get to now.',
        ),
        (
            replace(FINDING, kind=FindingKind.OTHER_MAP, ids=("old", "new")),
            '"a" belongs to the map "old", but the robot is on "new".',
        ),
        (
            replace(FINDING, kind=FindingKind.WRONG_ROOM, ids=("R1", "R2")),
            '"a" is filed under R1, but stands in R2.',
        ),
        (
            replace(
                FINDING, kind=FindingKind.WRONG_ROOM, ids=("R1", "R2"), label="sink", things=(SINK,)
            ),
            '"sink" of "a" lies in R1, which no door on the line from R2 opens to.',
        ),
        (
            replace(FINDING, kind=FindingKind.BEHIND_WALL, label="sink", told_m=9.0, open_m=1.0),
            '"sink" of "a": it is told as 9.0 m away, behind a wall at 1.0 m.',
        ),
        (
            replace(FINDING, kind=FindingKind.THROUGH_UNKNOWN, label="sink", open_m=1.0),
            '"sink" of "a": the line to it leaves the seen floor after 1.0 m.',
        ),
        (
            replace(FINDING, kind=FindingKind.DUPLICATE, waypoints=("a", "b"), far_m=0.1),
            '"a" and "b" stand 0.10 m apart and name the same things.',
        ),
        (
            replace(FINDING, kind=FindingKind.NOT_SEEN, things=(SINK,), far_m=3.0),
            (
                '"a" looked to where the "sink" at (2.00, 1.00) should be, 3.0 m away, '
                "and does not name it."
            ),
        ),
        (
            replace(FINDING, kind=FindingKind.POINTS_PAST, label="sink", things=(SINK,), view=VIEW),
            '"a" has it in plain sight, but points 12 deg past it, the "sink" at (2.00, 1.00).',
        ),
        (
            replace(FINDING, kind=FindingKind.TWO_LABELS, things=(SINK, STOVE)),
            (
                'In one place stand a "sink" at (2.00, 1.00) by one view and a "stove" at '
                "(2.00, 1.00) by 2 views."
            ),
        ),
    ],
    ids=lambda each: each.kind if isinstance(each, MemoryFinding) else "",
)
def test_a_finding_is_a_sentence_with_its_numbers(finding: MemoryFinding, said: str) -> None:
    assert say_finding(finding) == said


def test_trust_names_the_views_of_a_thing_before_what_speaks_against_it() -> None:
    assert say_trust(Trust(0.5, (FINDING,), SINK)) == ['Seen from 1: "a".', say_finding(FINDING)]
    assert say_trust(Trust(0.5, (FINDING,))) == [say_finding(FINDING)]


def test_a_view_is_told_by_how_far_and_how_far_off_it_is() -> None:
    assert say_support(VIEW) == "saw it 2.5 m away, told as 2.0 m, 12 deg off"
    assert say_support(replace(VIEW, off_rad=None)) == "names it, without a direction"
    assert say_conflict(VIEW) == "has it in plain sight, but points 12 deg past it"
