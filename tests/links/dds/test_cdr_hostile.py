"""Bytes and definitions that a robot should not send: refused, and cheaply."""

import tracemalloc
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from mapspeak.errors import LinkError
from mapspeak.links.cdr import MOST_BYTES, MOST_FIELDS, MOST_MESSAGES, Codec
from mapspeak.links.dds.types import build_type_book
from mapspeak.ros.definitions.types import TypeBook, hash_type

CODEC = Codec(build_type_book())
MOST_ALLOCATED_BYTES = 500_000
"""For a message of less than a thousand bytes."""

STAMPED = {"stamp": {"sec": 3, "nanosec": 4}, "frame_id": "map"}
MESSAGES: dict[str, dict[str, object]] = {
    "nav_msgs/OccupancyGrid": {"header": STAMPED, "info": {"width": 3}, "data": [0, -1, 100]},
    "sensor_msgs/LaserScan": {"header": STAMPED, "ranges": [1.0, 2.0], "intensities": [3.0]},
    "sensor_msgs/PointCloud2": {"fields": [{"name": "x"}, {"name": "y"}], "data": b"12345678"},
    "tf2_msgs/TFMessage": {"transforms": [{"header": STAMPED, "child_frame_id": "base"}] * 3},
    "nav_msgs/Odometry": {"header": STAMPED, "child_frame_id": "base"},
    "action_msgs/GoalStatusArray": {"status_list": [{"status": 2}, {"status": 4}]},
    "diagnostic_msgs/DiagnosticArray": {"status": [{"name": "a", "values": [{"key": "k"}]}]},
    "rcl_interfaces/ParameterValue": {
        "string_array_value": ["a", "bc"],
        "bool_array_value": [True],
    },
    "rmw_dds_common/ParticipantEntitiesInfo": {"node_entities_info_seq": [{"node_name": "a"}]},
}
WRITTEN = {name: CODEC.encode(name, message) for name, message in MESSAGES.items()}

SPOT = st.integers(0, 1000)
WORD = st.sampled_from([b"\xff" * 4, b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80", bytes(4), b"\xff"])
PIECE = WORD | st.binary(max_size=4)


@settings(max_examples=3000)
@given(
    st.sampled_from(sorted(MESSAGES)),
    st.lists(st.tuples(SPOT, st.sampled_from([0, 1, 4]), PIECE), min_size=1, max_size=4),
)
def test_a_spoiled_message_is_read_or_refused_and_costs_little(
    type_name: str, changes: list[tuple[int, int, bytes]]
) -> None:
    data = WRITTEN[type_name]
    for spot, n_dropped, piece in changes:
        start = spot % (len(data) + 1)
        data = data[:start] + piece + data[start + n_dropped :]
    tracemalloc.start()
    try:
        with suppress(LinkError):
            CODEC.decode(type_name, data)
        _, most_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most_bytes < MOST_ALLOCATED_BYTES


def test_more_messages_than_memory_is_for_are_refused() -> None:
    codec = Codec(TypeBook({"odd/Many": "Nothing[] many", "odd/Nothing": ""}))
    head = b"\x00\x01\x00\x00"
    read = codec.decode("odd/Many", head + (1000).to_bytes(4, "little") + bytes(1000))
    assert read == {"many": [{}] * 1000}
    with pytest.raises(LinkError, match="no odd/Many"):
        codec.decode("odd/Many", head + MOST_MESSAGES.to_bytes(4, "little") + bytes(MOST_MESSAGES))


def test_more_bytes_than_memory_is_for_are_refused() -> None:
    with pytest.raises(LinkError, match="was not read"):
        CODEC.decode("std_msgs/String", bytes(MOST_BYTES + 1))


LADDER = {f"odd/T{n}": f"T{n + 1} a\nT{n + 2} b" for n in range(28)}
LADDER |= {"odd/T28": "uint8 a", "odd/T29": "uint8[2] a"}


@pytest.mark.parametrize(
    "texts",
    [
        {"odd/A": f"string[{MOST_FIELDS + 1}] texts"},
        {"odd/A": "B[900000000] many", "odd/B": "uint8 a"},
        {"odd/A": "float64[900000000] many"},
        {"odd/A": "B[900] a", "odd/B": "C[900] a", "odd/C": "float64[900] a"},
        {"odd/A": "\n".join(f"uint8 a{n}" for n in range(MOST_FIELDS + 1))},
        {"odd/A": "B b", "odd/B": "A[] a"},
        {"odd/A": "Unheard b"},
        {"odd/A": "wstring b"},
    ],
    ids=["texts", "messages", "numbers", "nested", "fields", "itself", "unknown", "wide"],
)
def test_a_type_that_would_cost_too_much_is_refused_before_any_code_is_made(
    texts: dict[str, str],
) -> None:
    codec = Codec(TypeBook(texts))
    for use in (lambda: codec.encode("odd/A", {}), lambda: codec.decode("odd/A", bytes(8))):
        with pytest.raises(LinkError):
            use()


def test_types_that_hold_each_other_in_many_ways_are_laid_out_once() -> None:
    book = TypeBook(LADDER)
    codec = Codec(book)
    with pytest.raises(LinkError, match="no odd/T20"):
        codec.decode("odd/T20", b"\x00\x01\x00\x00")
    assert hash_type(book, "odd/T20").startswith("RIHS01_")


def test_a_type_that_holds_itself_has_no_hash() -> None:
    with pytest.raises(LinkError):
        hash_type(TypeBook({"odd/A": "B b", "odd/B": "A[] a"}), "odd/A")


def test_names_that_mean_something_in_python_are_names_like_others() -> None:
    names = ["from", "values", "__class__", "rawdata", "self", "2", "field1", "ﬁ"]
    codec = Codec(TypeBook({"odd/class": "\n".join(f"uint8 {name}" for name in names)}))
    message = {name: number for number, name in enumerate(names)}
    assert codec.decode("odd/class", codec.encode("odd/class", message)) == message
