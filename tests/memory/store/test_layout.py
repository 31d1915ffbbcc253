import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mapspeak.memory.store.layout import find_changed_records, find_records

LINES = (
    "waypoints:",
    "version: 1",
    "  - name: dock",
    "  - name: gate",
    "    x: 1.0",
    "    # the gate sticks",
    "  # between two records",
    "# at the margin",
    "events:",
    "- name: far left",
    "      - name: far right",
    "  -",
    "",
    "   odd: 1",
    "    text: a\u2028b",
)
TEXTS = st.lists(st.sampled_from(LINES), max_size=14).map("\n".join)
THREE = "waypoints:\n  - name: a\n    x: 1\n  - name: b\n\n  # c\n  - name: d\n"


@settings(max_examples=400)
@given(TEXTS, TEXTS, TEXTS, TEXTS)
@example(before=THREE, out="", new="  - name: e\n", after="")
@example(before="waypoints:\n  - name: a\n", out="", new="  - name: b\n", after="events:\n")
def test_what_changed_is_found_as_if_all_were_looked_at(
    before: str, out: str, new: str, after: str
) -> None:
    old, text = (f"waypoints:\n  - name: a\n{before}\n{part}\n{after}" for part in (out, new))
    layout = find_records(old)
    if layout.spans:
        assert find_changed_records(text, before=old, layout=layout) == find_records(text)


@settings(max_examples=400)
@given(st.data(), TEXTS, st.text("-n: \n#ab", max_size=6))
def test_a_change_in_the_middle_of_a_line_is_found_too(
    data: st.DataObject, lines: str, new: str
) -> None:
    old = f"waypoints:\n  - name: a\n  - name: b\n{lines}"
    start = data.draw(st.integers(0, len(old)))
    end = data.draw(st.integers(start, min(len(old), start + 8)))
    text = old[:start] + new + old[end:]
    layout = find_records(old)
    if layout.spans:
        assert find_changed_records(text, before=old, layout=layout) == find_records(text)


@pytest.mark.parametrize("more", ["", "  - name: e\n", "events: []\n", "  odd: 1\n"])
def test_what_is_added_at_the_end_is_found(more: str) -> None:
    found = find_changed_records(THREE + more, before=THREE, layout=find_records(THREE))
    assert found == find_records(THREE + more)
