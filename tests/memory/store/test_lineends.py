"""A write changes the ends of those lines alone that it changes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.geometry import Pose
from mapspeak.memory import Waypoint
from mapspeak.memory.events import Event
from mapspeak.memory.store.document import parse_document
from mapspeak.memory.store.layout import LineEnds
from mapspeak.memory.store.rewriting import with_event, with_waypoint

RECORD = b"  - name: dock\n    pose: {x: 1.00, y: 2.00, yaw_deg: 0.0}\n"
LIKE_UNIX = b"version: 1\r\n# own comment\nwaypoints:\n" + RECORD + b"other: x\r\nmine: y\n"
LIKE_WINDOWS = LIKE_UNIX.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n").replace(b"t\r\n", b"t\n")
LINES = st.lists(st.sampled_from(["a", "b", "c: d", ""]), max_size=8)
ENDS = st.sampled_from(["\n", "\r\n"])


@pytest.mark.parametrize(
    ("content", "end"), [(LIKE_UNIX, b"\n"), (LIKE_WINDOWS, b"\r\n")], ids=["unix", "windows"]
)
def test_new_lines_end_as_most_do_and_all_others_as_before(content: bytes, end: bytes) -> None:
    document = parse_document(content, source="places.yaml")

    with_hall = with_waypoint(document, Waypoint(name="hall", pose=Pose(3.0, 4.0)))
    with_both, _ = with_event(with_hall, Event(text="wet floor"))

    before, after = content.splitlines(keepends=True), with_both.content.splitlines(keepends=True)
    new = [line for line in after if line not in before]
    assert [line for line in after if line in before] == before
    assert len(new) >= 5
    assert {line.lstrip(line.rstrip(b"\r\n")) for line in new} == {end}


@pytest.mark.parametrize("content", [LIKE_UNIX, LIKE_WINDOWS])
def test_a_changed_value_leaves_all_other_lines_as_they_were(content: bytes) -> None:
    document = parse_document(content, source="places.yaml")

    changed = with_waypoint(document, Waypoint(name="dock", pose=Pose(9.0, 2.0)))

    assert changed.content == content.replace(b"x: 1.00", b"x: 9.00")


@given(
    st.lists(st.tuples(st.sampled_from(["a", "b", "c: d", ""]), ENDS)), st.text("ab", max_size=2)
)
def test_what_is_not_changed_is_the_same_to_the_byte(
    lines: list[tuple[str, str]], last: str
) -> None:
    text = "".join(line + end for line, end in lines) + last

    assert LineEnds.of(text).restored(text.replace("\r\n", "\n")) == text


@given(
    st.lists(st.tuples(st.integers(0, 99).map(str), ENDS), unique_by=lambda each: each[0]), LINES
)
def test_lines_put_in_anywhere_leave_the_others_as_they_were(
    lines: list[tuple[str, str]], new: list[str]
) -> None:
    text = "".join(line + end for line, end in lines)
    middle = len(lines) // 2
    put_in = [*(line for line, _ in lines[:middle]), *new, *(line for line, _ in lines[middle:])]

    told = LineEnds.of(text).restored("".join(f"{line}\n" for line in put_in))

    head = "".join(line + end for line, end in lines[:middle])
    assert told.startswith(head)
    assert told.endswith(text[len(head) :])
