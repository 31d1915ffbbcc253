"""What ROS types look like: .msg texts read, described, and messages held against them."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.errors import LinkError
from mapspeak.ros.definitions.checking import check_message, describe_type
from mapspeak.ros.definitions.texts import (
    known_definitions,
    split_definition,
    split_parts,
    write_definition,
)
from mapspeak.ros.definitions.types import Field, TypeBook, parse_definition
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import find_nearest

KNOWN = {dialect: TypeBook(known_definitions(dialect)) for dialect in Dialect}


def field_of(line: str) -> Field:
    (field,) = parse_definition("arm_msgs/Arm", line).fields
    return field


# --- texts


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ("float64 x", Field(name="x", type="float64")),
        ("  float64   x   # metres", Field(name="x", type="float64")),
        ("float64 w 1", Field(name="w", type="float64", default="1")),
        ("float64[36] covariance", Field(name="covariance", type="float64", length=36)),
        ("uint8[] data", Field(name="data", type="uint8", length=0)),
        ("Joint[<=6] joints", Field(name="joints", type="arm_msgs/Joint", length=0, most=6)),
        ("string<=10 name", Field(name="name", type="string", most_letters=10)),
        ("Header header", Field(name="header", type="std_msgs/Header")),
        ("geometry_msgs/msg/Pose pose", Field(name="pose", type="geometry_msgs/Pose")),
        ("time stamp", Field(name="stamp", type="time")),
    ],
)
def test_a_field_is_read_as_ros_writes_it(line: str, field: Field) -> None:
    assert field_of(line) == field


def test_constants_are_no_fields_and_remarks_say_nothing() -> None:
    text = "# An arm.\nuint8 FAST = 1 # quick\nstring MARK=#1\n\nuint8 speed"
    message = parse_definition("arm_msgs/Arm", text)
    assert list(message.constants.items()) == [
        ("FAST", "1"),
        ("MARK", "#1"),
    ]
    assert [field.name for field in message.fields] == ["speed"]


@given(st.text(max_size=200))
def test_any_text_is_read_without_a_crash(text: str) -> None:
    parse_definition("a/B", text)
    split_parts("a/B", text)


@pytest.mark.parametrize("dialect", Dialect)
def test_every_type_that_comes_with_mapspeak_is_whole(dialect: Dialect) -> None:
    book = KNOWN[dialect]
    for name in book.texts:
        assert book.missing(name) == []
        assert isinstance([book.default(field) for field in book[name].fields], list)
        assert check_message(book, name, {}) == {}


@pytest.mark.parametrize("dialect", Dialect)
def test_definitions_that_were_joined_come_apart_as_they_were(dialect: Dialect) -> None:
    texts = KNOWN[dialect].texts
    names = KNOWN[dialect].within("nav_msgs/Odometry")
    joined = write_definition(texts, names)
    assert split_definition("nav_msgs/Odometry", joined) == {name: texts[name] for name in names}


def test_a_service_and_an_action_have_parts() -> None:
    assert split_parts("a/Do", "int8 x\n---") == {"a/Do_Request": "int8 x", "a/Do_Response": ""}
    action = split_parts("a/Do", "---\nbool ok\n---\nint8 left")
    assert action == {"a/Do_Goal": "", "a/Do_Result": "bool ok", "a/Do_Feedback": "int8 left"}


def test_ros_1_has_its_own_times_and_its_own_header() -> None:
    stamped = "\n".join(describe_type(KNOWN[Dialect.ROS1], "geometry_msgs/PoseStamped"))
    assert "header: std_msgs/Header {seq: uint32, stamp: time, frame_id: string}" in stamped
    assert "w: float64 = 1" not in stamped
    assert KNOWN[Dialect.ROS1].knows("move_base_msgs/MoveBase_Goal")


def test_a_type_that_holds_itself_is_described_once() -> None:
    book = TypeBook({"a/Tree": "int8 x\na/Tree[] left\na/Tree[] right"})
    assert describe_type(book, "a/Tree") == [
        "x: int8",
        "left: a/Tree[]",
        "  x: int8",
        "  left: a/Tree[] (as above)",
        "  right: a/Tree[] (as above)",
        "right: a/Tree[] (as above)",
    ]


# --- messages

ARM = TypeBook(
    {
        "arm_msgs/Arm": (
            "int8 speed\nfloat32[3] axis\nstring<=4 name\nuint8[] data\nbool on\n"
            "arm_msgs/Joint[<=2] joints\nwstring wide\nother_msgs/Thing thing"
        ),
        "arm_msgs/Joint": "float64 angle",
    }
)


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"speed": -128, "on": True, "name": "left", "data": [0, 255]},
        {"data": "AAEC", "axis": [1, 2.5, 0], "joints": [{"angle": 1}, {}]},
    ],
)
def test_a_message_that_fits_may_be_sent(message: dict[str, Any]) -> None:
    assert check_message(ARM, "arm_msgs/Arm", message) == message


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"speed": 128}, "speed wants a whole number from -128 to 127 (int8), not 128"),
        ({"speed": 1.0}, "speed wants a whole number"),
        ({"axis": [1, 2]}, "axis has 2 values; its type is float32[3]. Give 3 values."),
        ({"axis": [1, 2, 1e39]}, "axis[2] wants a finite number (float32)"),
        ({"axis": [1, 2, math.nan]}, "axis[2] wants a finite number"),
        ({"axis": "1 2 3"}, "axis wants a list (float32[3])"),
        ({"name": "right"}, "name has 5 letters; its type is string<=4"),
        ({"name": 3}, "name wants a text (string<=4), not 3"),
        ({"on": 1}, "on wants true or false (bool), not 1"),
        ({"on": None}, "on wants true or false (bool), not None"),
        ({"data": [256]}, "data[0] wants a whole number from 0 to 255 (uint8), not 256"),
        ({"data": "?"}, "data wants a list (uint8[]), or bytes in base64, not '?'"),
        ({"joints": [{}, {}, {}]}, "joints has 3 values; its type is arm_msgs/Joint[<=2]"),
        ({"joints": [{"angel": 1}]}, "no field 'joints[0].angel'. Did you mean joints[0].angle?"),
        ({"joints": [1]}, "joints[0] wants an object of type arm_msgs/Joint, not 1"),
        ({"thing": {}}, "thing is a other_msgs/Thing, which nobody has described"),
        ({"wide": "\ud800"}, "wide wants a text"),
    ],
)
def test_a_message_that_does_not_fit_is_refused_with_its_path(
    message: dict[str, Any], said: str
) -> None:
    with pytest.raises(LinkError) as caught:
        check_message(ARM, "arm_msgs/Arm", message)
    assert said in str(caught.value)


def test_a_stamp_in_the_words_of_the_other_ros_is_refused() -> None:
    message = {"header": {"stamp": {"sec": 1, "nanosec": 2}}}
    with pytest.raises(LinkError, match=r"no field 'header\.stamp\.sec'.*secs: uint32"):
        check_message(KNOWN[Dialect.ROS1], "geometry_msgs/PoseStamped", message)


def test_a_name_is_found_by_its_end_or_by_its_likeness() -> None:
    names = ["/robot1/scan", "/cmd_vel", "/map", "/map_metadata"]
    assert find_nearest("/scan", names)[0] == "/robot1/scan"
    assert find_nearest("/cmd_val", names)[0] == "/cmd_vel"
    assert find_nearest("/zzz", names) == []
