"""Whatever becomes of a file: it is read, or its fault is told."""

import contextlib

from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Waypoint
from mapspeak.memory.store.document import MapDocument, parse_document

FILE = b"""\
# places #1
version: 1
map: b1
waypoints:
  - name: Dock   # mine
    pose: {x: 1.0, y: 2, yaw_deg: 270}
    safety_landmarks:
      - exit sign
      - label: hose
        range_m: 3
    description: |
      A hall.

  - {name: "Hall", pose: {x: 0, y: 0, yaw_deg: 0}, lit: yes}
tail: [1, 2]
"""

DAMAGE = st.tuples(st.integers(0, len(FILE)), st.integers(0, 6), st.binary(max_size=4))
SYNTAX = st.sampled_from([b"\n", b"  ", b"- ", b": ", b"#", b"[", b"}", b'"', b"|", b"&a ", b"*a"])
REPLACED = st.tuples(st.integers(0, len(FILE)), st.integers(0, 6), SYNTAX)


@settings(max_examples=100)
@given(st.lists(DAMAGE | REPLACED, min_size=1, max_size=3))
def test_any_damaged_file_is_a_map_or_a_semantic_map_error(
    damages: list[tuple[int, int, bytes]],
) -> None:
    content = FILE
    for start, n_lost, put in damages:
        content = content[:start] + put + content[start + n_lost :]

    with contextlib.suppress(SemanticMapError):
        document = parse_document(content, source="places.yaml")
        changed = document.with_record(Waypoint(name="new", pose=Pose(0.0, 0.0)))
        assert len(changed.lists["waypoints"]) == len(document.lists["waypoints"]) + 1


LINES = (
    "waypoints:",
    "  - name: a",
    "    pose: {x: 0, y: 0, yaw_deg: 0}",
    "  # between",
    "",
    "  - name: b",
    "    pose: {x: 1, y: 0, yaw_deg: 0}",
    "    description: |",
    "      - no dash",
    "  - {name: c, pose: {x: 2, y: 0, yaw_deg: 0}}",
    "  - name: d",
    "    pose: {x: 3, y: 0, yaw_deg: 0}",
    "    lihgt: yes",
    "map: b1",
)
PUT_IN = st.sampled_from(
    [
        *LINES,
        "  -",
        "  - name: e",
        "   - name: e",
        "- x",
        "    x: 1",
        "version: 1",
        "events: [{text: wet}]",
        "waypoints: []",
    ]
)
EDITS = st.lists(
    st.tuples(st.integers(0, len(LINES)), st.integers(0, 3), st.lists(PUT_IN, max_size=3)),
    min_size=1,
    max_size=2,
)


@settings(max_examples=300)
@given(EDITS, st.sampled_from(["", "\n", " \n", "\n\n", "\r\n"]))
def test_a_file_read_again_after_an_edit_reads_as_if_it_were_new(
    edits: list[tuple[int, int, list[str]]], end: str
) -> None:
    before = parse_document("\n".join(LINES).encode(), source="places.yaml")
    lines = list(LINES)
    for start, n_lost, put in edits:
        lines[start : start + n_lost] = put
    content = ("\n".join(lines) + end).encode()

    assert _told(content, before) == _told(content, None)


def _told(content: bytes, previous: MapDocument | None) -> object:
    try:
        document = parse_document(content, source="places.yaml", previous=previous)
    except SemanticMapError as fault:
        return str(fault)
    return document.places, document.sections, document.text, list(document.lists["events"])
