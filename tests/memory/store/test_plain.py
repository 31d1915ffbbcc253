"""The quick reader must never say other than the YAML parser."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.memory import Waypoint
from mapspeak.memory.store.cutting import read_plain_record
from mapspeak.memory.store.records import data_of
from mapspeak.memory.store.yamltext import Data, TextFaultError, compose
from mapspeak.memory.store.yamltext import data_of as read_data
from mapspeak.memory.store.yamlwriting import record_text
from waypoints import waypoints

RECORD = """\
  - name: dock corner
    description: A corner beside the loading dock, cold.
    pose: {x: 1.20, y: -3.40, yaw_deg: 90.0}
    safety_landmarks: [fire extinguisher, exit sign]
    functional_landmarks:
      - {label: tap, bearing_deg: 28.65, range_m: 2.25}
      - {label: sink, confidence: likely, picture: P1.jpg, recorded_at: 2026-11-02T10:30:00Z}
      - rack
    geometric_features: []
    recorded_at: 2026-11-02T10:30:00+00:00
"""


def read_slowly(block: str) -> Data:
    data = read_data(compose(block))
    return data[0] if isinstance(data, list) and len(data) == 1 else None


def test_a_record_as_mapspeak_lays_it_out_is_read_without_the_yaml_parser() -> None:
    assert read_plain_record(RECORD) == read_slowly(RECORD)
    assert read_plain_record(RECORD) is not None


@pytest.mark.parametrize(
    "line",
    [
        "name: a # b",
        "name: 'a'",
        "name: a: b",
        "name: |",
        "name: &a b",
        "name: !!str a",
        "name: null",
        "name:",
        "name: [a, [b]]",
        "name: [a,b]",
        "name: {a: b, a: c}",
        "name: {a: b, }",
        "name: {a: [b]}",
        'name: "a\\u0041"',
        'name: "a',
        "name: a\n     b",
        "name: a\n  # b",
        "name: a\n      - b",
        "name: a\n    name: b",
        "name: a\n  - name: b",
        "name:\ta",
    ],
)
def test_what_is_more_than_plain_is_left_to_the_yaml_parser(line: str) -> None:
    assert read_plain_record(f"  - {line}\n") is None


@settings(max_examples=40)
@given(waypoints(has_poses=True))
def test_any_record_of_mapspeak_is_read_as_by_the_yaml_parser(waypoint: Waypoint) -> None:
    block = record_text(data_of(waypoint), indent=2)

    assert read_plain_record(block) in (None, read_slowly(block))


@settings(max_examples=100)
@given(st.data())
def test_any_damaged_record_is_read_as_by_the_yaml_parser_or_not_at_all(
    data: st.DataObject,
) -> None:
    start = data.draw(st.integers(0, len(RECORD)))
    end = data.draw(st.integers(start, min(len(RECORD), start + 8)))
    block = RECORD[:start] + data.draw(st.text(" \n-:#[]{},'\"|>&*a1.", max_size=4)) + RECORD[end:]

    quick = read_plain_record(block)

    if quick is not None:
        try:
            slow = read_slowly(block)
        except TextFaultError as error:
            slow = str(error)
        assert quick == slow
