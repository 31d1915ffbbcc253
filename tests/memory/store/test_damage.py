"""Whatever becomes of a file: it is read, or its fault is told."""

import contextlib

from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Waypoint
from mapspeak.memory.store.document import parse_document
from mapspeak.memory.store.rewriting import with_waypoint

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
        changed = with_waypoint(document, Waypoint(name="new", pose=Pose(0.0, 0.0)))
        assert len(changed.records) == len(document.records) + 1
