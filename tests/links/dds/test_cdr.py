import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from mapspeak.errors import LinkError
from mapspeak.links.cdr import Codec, Store
from mapspeak.links.dds.types import build_type_book, read_type_description
from mapspeak.ros.definitions.texts import action_parts
from mapspeak.ros.definitions.types import TypeBook, parse_definition
from messaging import messages_of, plain

BOOK = build_type_book()
CODEC = Codec(BOOK)
TYPES = sorted(name for name in BOOK.texts if not BOOK.missing(name))
ODD = TypeBook(
    {
        "odd/All": (
            "bool truth\nint8 a\nuint16 b\nint64 c\nfloat32 d\nstring text\nstring[] texts\n"
            "float64[] many\nfloat32[3] three\nbool[] truths\nuint8[] data\nint16[<=4] few\n"
            "odd/Inner inner\nodd/Inner[] inners\nodd/Nothing nothing"
        ),
        "odd/Inner": "uint8 small\nfloat64 large",
        "odd/Nothing": "",
    }
)
ODD_CODEC = Codec(ODD)
ODD_CODEC.decode("odd/All", ODD_CODEC.encode("odd/All", {}))


def floats(width: int) -> st.SearchStrategy[float]:
    return st.floats(allow_nan=False, allow_infinity=False, width=32 if width == 32 else 64)


INNER = st.fixed_dictionaries({"small": st.integers(0, 255), "large": floats(64)})
TEXT = st.text(st.characters(exclude_characters="\x00", codec="utf-8"), max_size=8)
ALL = st.fixed_dictionaries(
    {
        "truth": st.booleans(),
        "a": st.integers(-128, 127),
        "b": st.integers(0, 65535),
        "c": st.integers(-(2**63), 2**63 - 1),
        "d": floats(32),
        "text": TEXT,
        "texts": st.lists(TEXT, max_size=3),
        "many": st.lists(floats(64), max_size=3),
        "three": st.lists(floats(32), min_size=3, max_size=3),
        "truths": st.lists(st.booleans(), max_size=3),
        "data": st.lists(st.integers(0, 255), max_size=5),
        "few": st.lists(st.integers(-(2**15), 2**15 - 1), max_size=4),
        "inner": INNER,
        "inners": st.lists(INNER, max_size=3),
        "nothing": st.just({}),
    }
)


@given(ALL)
def test_a_message_comes_back_as_it_was_written(message: dict[str, object]) -> None:
    written = ODD_CODEC.encode("odd/msg/All", message)
    assert plain(ODD_CODEC.decode("odd/msg/All", written)) == message


@given(st.binary(max_size=80), st.sampled_from([0, 1]))
def test_any_bytes_are_a_message_or_an_error(data: bytes, order: int) -> None:
    with suppress(LinkError):
        ODD_CODEC.decode("odd/All", bytes([0, order, 0, 0]) + data)


@given(ALL, st.data())
def test_a_message_cut_off_is_an_error(message: dict[str, object], data: st.DataObject) -> None:
    written = ODD_CODEC.encode("odd/All", message)
    length = data.draw(st.integers(0, len(written) - 1))
    with pytest.raises(LinkError):
        ODD_CODEC.decode("odd/All", written[:length])


@settings(max_examples=300)
@given(st.data())
def test_any_message_of_any_type_comes_back_as_it_was_written(data: st.DataObject) -> None:
    type_name = data.draw(st.sampled_from(TYPES))
    message = data.draw(messages_of(BOOK, type_name))
    read = plain(CODEC.decode(type_name, CODEC.encode(type_name, message)))
    assert {name: read[name] for name in message} == plain_where_told(message, read)
    assert plain(CODEC.decode(type_name, CODEC.encode(type_name, read))) == read


def plain_where_told(message: dict[str, Any], read: dict[str, Any]) -> dict[str, Any]:
    """Give a message with what it leaves out within, which is read as the default."""
    return {name: _with_defaults(value, read[name]) for name, value in message.items()}


def _with_defaults(told: Any, read: Any) -> Any:  # noqa: ANN401 - ROS JSON
    match told:
        case dict():
            return {**read, **plain_where_told(told, read)}
        case list():
            return [_with_defaults(one, other) for one, other in zip(told, read, strict=True)]
        case _:
            return told


@pytest.mark.parametrize(
    ("type_name", "message", "written"),
    [
        ("std_msgs/Byte", {"data": 200}, "00010000 c8"),
        (
            "sensor_msgs/JointState",
            {"name": ["a", "bcd"], "position": [1.5, -2.0]},
            (
                "00010000 00000000 00000000 01000000 00000000 02000000 02000000 61000000 04000000 "
                "62636400 02000000 00000000 0000f83f 00000000 000000c0 00000000 00000000"
            ),
        ),
        (
            "rcl_interfaces/ParameterValue",
            {"type": 8, "double_array_value": [1.5], "string_array_value": ["x", "yz"]},
            (
                "00010000 08000000 00000000 00000000 00000000 00000000 00000000 01000000 00000000 "
                "00000000 00000000 00000000 01000000 00000000 0000f83f 02000000 02000000 78000000 "
                "03000000 797a00"
            ),
        ),
        (
            "nav_msgs/OccupancyGrid",
            {"info": {"resolution": 0.5, "width": 3, "height": 1}, "data": [-1, 0, 100]},
            (
                "00010000 00000000 00000000 01000000 00000000 00000000 00000000 0000003f 03000000 "
                "01000000 00000000 00000000 00000000 00000000 00000000 00000000 00000000 00000000 "
                "00000000 00000000 00000000 00000000 00000000 00000000 0000f03f 03000000 ff0064"
            ),
        ),
        (
            "tf2_msgs/TFMessage",
            {"transforms": [{"header": {"frame_id": "map"}, "child_frame_id": "odom"}]},
            (
                "00010000 01000000 00000000 00000000 04000000 6d617000 05000000 6f646f6d 00000000 "
                "00000000 00000000 00000000 00000000 00000000 00000000 00000000 00000000 00000000 "
                "00000000 00000000 00000000 00000000 0000f03f"
            ),
        ),
        (
            "action_msgs/GoalStatusArray",
            {"status_list": [{"status": 2}, {"goal_info": {"stamp": {"sec": 7}}, "status": 4}]},
            (
                "00010000 02000000 00000000 00000000 00000000 00000000 00000000 00000000 02000000 "
                "00000000 00000000 00000000 00000000 07000000 00000000 04"
            ),
        ),
    ],
    ids=lambda value: value if isinstance(value, str) and "/" in value else "",
)
def test_bytes_are_those_that_rclpy_writes(
    type_name: str, message: dict[str, Any], written: str
) -> None:
    data = bytes.fromhex(written)
    assert CODEC.encode(type_name, message) == data
    read = plain(CODEC.decode(type_name, data))
    assert plain_where_told(message, read) == {name: read[name] for name in message}


def test_numbers_stand_at_multiples_of_their_size() -> None:
    header = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"}
    written = CODEC.encode("geometry_msgs/msg/PointStamped", {"header": header, "point": {"x": 1}})
    assert written.hex(" ", 4) == (
        "00010000 01000000 02000000 04000000 6d617000 "  # four bytes of header, not counted
        "00000000 0000f03f 00000000 00000000 00000000 00000000"
    )


def test_the_other_byte_order_is_understood() -> None:
    written = bytes.fromhex("00000000 00000001 00000002 00000004 6d617000")
    assert CODEC.decode("std_msgs/msg/Header", written) == {
        "stamp": {"sec": 1, "nanosec": 2},
        "frame_id": "map",
    }


def test_a_message_without_fields_is_one_byte_and_its_padding_may_be_left_away() -> None:
    assert CODEC.encode("std_srvs/srv/Empty_Request", {}) == b"\x00\x01\x00\x00\x00"
    assert CODEC.decode("std_srvs/srv/Empty_Response", b"\x00\x01\x00\x00\x00\x00\x00\x00") == {}


def test_what_is_left_out_holds_its_default() -> None:
    pose = CODEC.decode("geometry_msgs/Pose", CODEC.encode("geometry_msgs/Pose", {}))
    assert pose["position"] == {"x": 0.0, "y": 0.0, "z": 0.0}
    assert pose["orientation"]["w"] == 1.0


def test_cells_are_read_where_they_lie() -> None:
    cells = np.arange(6, dtype=np.int8)
    grid = {"info": {"width": 3, "height": 2}, "data": cells}
    written = CODEC.encode("nav_msgs/OccupancyGrid", grid)
    read = CODEC.decode("nav_msgs/OccupancyGrid", written)["data"]
    assert read.dtype == np.int8
    assert not read.flags.owndata
    assert read.tolist() == cells.tolist()


@pytest.mark.parametrize(
    ("type_name", "message", "named"),
    [
        ("geometry_msgs/Twist", {"linear": {"x": float("nan")}}, "linear.x"),
        ("geometry_msgs/Twist", {"linear": {"x": float("inf")}}, "linear.x"),
        ("sensor_msgs/LaserScan", {"ranges": [1.0, float("inf")]}, "ranges"),
        ("sensor_msgs/LaserScan", {"ranges": np.array([np.nan])}, "ranges"),
        ("std_msgs/Float32", {"data": 1e300}, "data"),
        ("std_msgs/UInt8", {"data": 256}, "data"),
        ("std_msgs/UInt8", {"data": True}, "data"),
        ("std_msgs/Int32", {"data": 1.5}, "data"),
        ("std_msgs/Int32", {"data": 10**400}, "data"),
        ("std_msgs/Bool", {"data": "yes"}, "data"),
        ("std_msgs/String", {"data": 7}, "data"),
        ("std_msgs/String", {"data": "\ud800"}, "data"),
        ("std_msgs/String", {"data": "a\x00b"}, "data"),
        ("std_msgs/String", {"text": "a"}, "text"),
        ("std_msgs/String", [], "std_msgs/String"),
        ("unique_identifier_msgs/UUID", {"uuid": b"short"}, "uuid"),
        ("unique_identifier_msgs/UUID", {"uuid": "no base64"}, "uuid"),
        ("tf2_msgs/TFMessage", {"transforms": {}}, "transforms"),
        ("sensor_msgs/JointState", {"position": [[1.0]]}, "position"),
        ("nav_msgs/OccupancyGrid", {"data": [200]}, "data"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_name(
    type_name: str, message: dict[str, object], named: str
) -> None:
    with pytest.raises(LinkError) as refused:
        CODEC.encode(type_name, message)
    assert named in refused.value.message


def test_an_unknown_type_is_an_error_that_says_what_to_do() -> None:
    with pytest.raises(LinkError, match="my_msgs/Secret"):
        CODEC.decode("my_msgs/msg/Secret", b"\x00\x01\x00\x00")


def test_another_encoding_is_no_message() -> None:
    with pytest.raises(LinkError):
        CODEC.decode("std_msgs/Header", b"\x00\x07\x00\x00" + bytes(12))


def test_an_action_has_the_parts_that_ros_makes_of_it() -> None:
    book = TypeBook({**BOOK.texts, **action_parts("my_msgs/action/Dance")})
    assert (
        book.texts["my_msgs/Dance_GetResult_Response"] == "int8 status\nmy_msgs/Dance_Result result"
    )


def test_humbles_navigation_has_an_empty_result() -> None:
    humble = Codec(build_type_book("humble"))
    data = bytes.fromhex("00010000 04 00")
    assert humble.decode("nav2_msgs/action/NavigateToPose_GetResult_Response", data) == {
        "status": 4,
        "result": {"result": {}},
    }


def field(name: str, type_id: int, *, capacity: int = 0, nested: str = "") -> dict[str, object]:
    kind = {"type_id": type_id, "capacity": capacity, "nested_type_name": nested}
    return {"name": name, "type": kind}


def test_a_type_is_learned_from_what_a_node_says() -> None:
    described = {
        "type_name": "my_msgs/msg/Secret",
        "fields": [
            field("label", 17),
            field("where", 1, nested="geometry_msgs/msg/Point"),
            field("corners", 145, nested="geometry_msgs/msg/Point"),
            field("three", 59, capacity=3),
            field("few", 99, capacity=2),
        ],
    }
    answer = {
        "successful": True,
        "type_description": {"type_description": described, "referenced_type_descriptions": []},
    }
    assert read_type_description(answer) == {
        "my_msgs/Secret": "string label\ngeometry_msgs/msg/Point where\n"
        "geometry_msgs/msg/Point[] corners\nfloat64[3] three\nuint8[<=2] few"
    }


def test_a_node_that_does_not_know_its_type_is_an_error() -> None:
    with pytest.raises(LinkError, match="no such type"):
        read_type_description({"successful": False, "failure_reason": "no such type"})


@pytest.fixture
def eager_threads() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("eager_threads")
def test_threads_that_meet_new_types_at_once_do_not_mix_them_up() -> None:
    store = Store()
    types = [parse_definition(f"odd/Of{n}", f"string text{n}\n" * 9) for n in range(2000)]
    with ThreadPoolExecutor(4) as threads:
        layouts = list(threads.map(lambda each: store.lay_out(each, {}), types, chunksize=1))
    assert len({layout.name for layout in layouts}) == len(types)
