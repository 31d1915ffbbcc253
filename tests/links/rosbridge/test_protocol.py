"""The rosbridge protocol: frames in, events out, whatever is sent."""

import json
import math
from functools import partial
from typing import Any

import cbor2
import numpy as np
import orjson
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.protocol.bounds import MAX_UNFINISHED, FragmentStore, FrameFault
from mapspeak.links.rosbridge.protocol.codec import BARE_NUMBER
from mapspeak.links.rosbridge.protocol.conversation import (
    LIGHT_BYTES,
    Conversation,
    Encoding,
    Event,
    EventKind,
    FrameRefused,
    ServerEvent,
    write_operation,
)
from mapspeak.ros.port import new_id


def frame(operation: dict[str, Any]) -> bytes:
    return orjson.dumps(operation)


def told(event: Event | None, kind: EventKind) -> ServerEvent:
    assert isinstance(event, ServerEvent)
    assert event.kind is kind
    return event


published = partial(told, kind=EventKind.PUBLISHED)


def refused(event: Event | None) -> FrameFault:
    assert isinstance(event, FrameRefused)
    return event.fault


def pieces_of(text: str, n_pieces: int, *, total: float | None = None) -> list[bytes]:
    size = math.ceil(len(text) / n_pieces)
    return [
        frame(
            {
                "op": "fragment",
                "id": 0,
                "data": text[index * size : (index + 1) * size],
                "num": index,
                "total": n_pieces if total is None else total,
            }
        )
        for index in range(n_pieces)
    ]


HELLO = {"op": "publish", "topic": "/greeting", "msg": {"data": "hello"}}


def test_a_publication_says_its_topic_and_its_message() -> None:
    event = published(Conversation().receive(frame(HELLO), is_text=True))
    assert event.key == "/greeting"
    assert event.values == {"data": "hello"}


def test_slashes_may_be_escaped() -> None:
    text = rb'{"op": "publish", "topic": "\/map", "msg": {}}'
    assert published(Conversation().receive(text, is_text=True)).key == "/map"


def test_answers_carry_the_id_of_their_call() -> None:
    conversation = Conversation()
    good = {"op": "service_response", "id": "b", "values": {"sum": 3}, "result": True}
    bad = {"op": "service_response", "id": "a", "values": "no such service", "result": False}
    assert conversation.receive(frame(good), is_text=True) == ServerEvent(
        kind=EventKind.ANSWERED, key="b", values={"sum": 3}
    )
    assert conversation.receive(frame(bad), is_text=True) == ServerEvent(
        kind=EventKind.ANSWERED, key="a", is_result=False, values="no such service"
    )


def test_only_the_status_of_an_action_says_how_it_ended() -> None:
    aborted = {
        "op": "action_result",
        "id": "goal",
        "status": 6,
        "result": True,
        "values": {"error_code": 0},
    }
    assert Conversation().receive(frame(aborted), is_text=True) == ServerEvent(
        kind=EventKind.ENDED, key="goal", status=6, values={"error_code": 0}
    )


def test_feedback_and_remarks_are_told_apart() -> None:
    conversation = Conversation()
    feedback = {"op": "action_feedback", "id": "g", "values": {"distance_remaining": 1.5}}
    remark = {"op": "status", "level": "error", "msg": "no", "id": "x"}
    assert conversation.receive(frame(feedback), is_text=True) == ServerEvent(
        kind=EventKind.FED_BACK, key="g", values={"distance_remaining": 1.5}
    )
    assert conversation.receive(frame(remark), is_text=True) == ServerEvent(
        kind=EventKind.NOTED, key="error", values="no"
    )


@pytest.mark.parametrize("spelling", ["NaN", "nan", "-nan"])
def test_not_a_number_is_read_however_it_is_spelled(spelling: str) -> None:
    text = f'{{"op": "publish", "topic": "/scan", "msg": {{"r": [1.0, {spelling}]}}}}'
    ranges = published(Conversation().receive(text.encode(), is_text=True)).values["r"]
    assert ranges[0] == 1.0
    assert math.isnan(ranges[1])


@pytest.mark.parametrize("spelling", ["Infinity", "inf", "-Infinity", "-inf", "Inf", "+inf"])
def test_infinity_is_read_however_it_is_spelled(spelling: str) -> None:
    text = f'{{"op": "publish", "topic": "/scan", "msg": {{"r": {spelling}, "w": "inf, NaN"}}}}'
    message = published(Conversation().receive(text.encode(), is_text=True)).values
    assert message == {"r": float(spelling), "w": "inf, NaN"}


@pytest.mark.parametrize(
    ("tag", "dtype"), [(69, "<u2"), (72, "i1"), (78, "<i4"), (81, ">f4"), (85, "<f4")]
)
def test_cbor_typed_arrays_become_numpy_arrays(tag: int, dtype: str) -> None:
    numbers = np.array([0, 1, 100], dtype=dtype)
    message = {"data": cbor2.CBORTag(tag, numbers.tobytes())}
    event = Conversation().receive(
        cbor2.dumps({"op": "publish", "topic": "/map", "msg": message}), is_text=False
    )
    data = published(event).values["data"]
    assert data.dtype == np.dtype(dtype)
    assert data.tolist() == [0, 1, 100]


def test_a_cbor_array_of_bytes_becomes_bytes() -> None:
    message = {"data": cbor2.CBORTag(64, b"jpeg")}
    event = Conversation().receive(
        cbor2.dumps({"op": "publish", "topic": "/camera", "msg": message}), is_text=False
    )
    assert published(event).values == {"data": b"jpeg"}


@pytest.mark.parametrize("tag", [2, 28, 35, 258])
def test_cbor_tags_that_no_message_needs_are_refused(tag: int) -> None:
    hostile = cbor2.dumps({"op": "publish", "topic": "/x", "msg": cbor2.CBORTag(tag, b"1")})
    assert refused(Conversation().receive(hostile, is_text=False)) is FrameFault.NO_CBOR


def test_a_long_list_of_whole_numbers_arrives_as_an_array() -> None:
    cells = [-1, 0, 100] * 20_000
    message = {"info": {"width": 3}, "data": cells}
    text = frame({"op": "publish", "topic": "/map", "msg": message})
    event = published(Conversation().receive(text, is_text=True))
    assert isinstance(event.values["data"], np.ndarray)
    assert event.values["data"].tolist() == cells
    assert event.values["info"] == {"width": 3}


@pytest.mark.parametrize("spoilt", ["1,,2", "1 2", "--1", "1,", "-", "-,1"])
def test_a_long_list_with_a_fault_in_it_is_no_message(spoilt: str) -> None:
    numbers = "0," * 20_000 + spoilt
    text = f'{{"op": "publish", "topic": "/map", "msg": {{"data": [{numbers}]}}}}'
    assert refused(Conversation().receive(text.encode(), is_text=True)) is FrameFault.NO_JSON


def test_long_lists_find_their_places_wherever_they_stand() -> None:
    values = {"first": {"data": [1] * 30_000}, "all": [[0.5] * 9_000, [300] * 9_000], "data": [2]}
    text = frame({"op": "service_response", "id": "1", "values": values})
    event = told(Conversation().receive(text, is_text=True), EventKind.ANSWERED)
    assert event.values["data"] == [2]
    assert event.values["first"]["data"].tolist() == [1] * 30_000
    assert [each.tolist() for each in event.values["all"]] == values["all"]
    assert event.values["first"]["data"].nbytes == 30_000


def test_a_long_list_may_hold_what_is_no_number() -> None:
    ranges = "Infinity, 1.5, NaN, -Infinity, " * 10_000 + "2e3"
    text = f'{{"op": "publish", "topic": "/scan", "msg": {{"ranges": [{ranges}]}}}}'
    read = published(Conversation().receive(text.encode(), is_text=True)).values["ranges"]
    assert read[[0, 1, 3, -1]].tolist() == [math.inf, 1.5, -math.inf, 2000.0]
    assert math.isnan(read[2])


def test_a_long_list_within_a_text_stays_there() -> None:
    said = f"[{'1,' * 20_000}1]"
    text = frame({"op": "publish", "topic": "/log", "msg": {"said": said, "list": [1] * 20_000}})
    assert published(Conversation().receive(text, is_text=True)).values["said"] == said


def test_pieces_are_put_together_in_any_order_with_a_fraction_for_a_total() -> None:
    conversation = Conversation()
    # Measured: 60,058,350 characters in pieces of 10,000,000 come as 7 pieces "of 7.005835".
    pieces = pieces_of(json.dumps(HELLO), 5, total=5.4027)
    events = [
        conversation.receive(piece, is_text=True) for piece in [*reversed(pieces[1:]), pieces[0]]
    ]
    assert events[:-1] == [None] * 4
    assert published(events[-1]).values == {"data": "hello"}
    assert conversation.fragments.n_bytes == 0


def test_a_piece_that_comes_twice_changes_nothing() -> None:
    conversation = Conversation()
    first, second = pieces_of(json.dumps(HELLO), 2)
    assert conversation.receive(first, is_text=True) is None
    assert conversation.receive(first, is_text=True) is None
    assert published(conversation.receive(second, is_text=True)).key == "/greeting"


def test_a_message_cut_short_does_not_spoil_the_next_with_the_same_id() -> None:
    conversation = Conversation()
    conversation.receive(pieces_of("x" * len(json.dumps(HELLO)), 2)[0], is_text=True)
    events = [
        conversation.receive(piece, is_text=True) for piece in pieces_of(json.dumps(HELLO), 2)
    ]
    assert published(events[-1]).key == "/greeting"


def test_pieces_that_are_never_complete_do_not_fill_the_memory() -> None:
    conversation = Conversation(max_bytes=10_000)
    for number in range(1_000):
        piece = {"op": "fragment", "id": number, "num": 0, "total": 2, "data": "x" * 1_000}
        assert conversation.receive(frame(piece), is_text=True) is None
        assert conversation.fragments.n_bytes <= 10_000


@pytest.mark.parametrize("total", [0, 0.9, -1, 1e300, "3", None, True])
def test_a_piece_of_an_impossible_whole_is_refused(total: object) -> None:
    piece = {"op": "fragment", "id": 0, "num": 0, "total": total, "data": "x"}
    assert refused(Conversation().receive(frame(piece), is_text=True)) is FrameFault.NO_FRAGMENT


def test_pieces_within_pieces_are_refused() -> None:
    inner = pieces_of(json.dumps(HELLO), 1)[0]
    outer = pieces_of(inner.decode(), 1)[0]
    assert refused(Conversation().receive(outer, is_text=True)) is FrameFault.UNKNOWN_OPERATION


def test_pictures_that_nobody_asked_for_are_not_unpacked() -> None:
    wrapped = frame({"op": "png", "data": ""})
    assert refused(Conversation().receive(wrapped, is_text=True)) is FrameFault.UNKNOWN_OPERATION


def test_a_frame_beyond_the_limit_is_refused_unread() -> None:
    text = frame(HELLO)
    assert (
        refused(Conversation(max_bytes=len(text) - 1).receive(text, is_text=True))
        is FrameFault.TOO_LARGE
    )


@pytest.mark.parametrize("depth", [70, 900, 1_100, 20_000])
def test_deep_nesting_is_refused(depth: int) -> None:
    deep = b'{"op": "publish", "topic": "/x", "msg": {"a": ' + b"[" * depth + b"nan"
    assert refused(Conversation().receive(deep, is_text=True)) in {
        FrameFault.NO_JSON,
        FrameFault.TOO_DEEP,
    }
    assert refused(Conversation().receive(deep + b"]" * depth + b"}}", is_text=True)) in {
        FrameFault.NO_JSON,
        FrameFault.TOO_DEEP,
    }
    assert refused(Conversation().receive(b"\x81" * depth + b"\0", is_text=False)) in {
        FrameFault.NO_CBOR,
        FrameFault.TOO_DEEP,
    }
    assert refused(Conversation().receive(b"\xc6" * depth + b"\0", is_text=False)) in {
        FrameFault.NO_CBOR,
        FrameFault.TOO_DEEP,
    }


def bomb_of(n_lists: int) -> bytes:
    return b'{"op": "publish", "topic": "/x", "msg": {"a": [' + b"[]," * n_lists + b"[]]}}"


def test_a_frame_with_too_many_lists_is_refused_unread() -> None:
    assert refused(Conversation().receive(bomb_of(2_000_000), is_text=True)) is FrameFault.TOO_LARGE
    assert (
        refused(Conversation().receive(cbor2.dumps([[]] * 200_000), is_text=False))
        is FrameFault.TOO_LARGE
    )
    endless = b"\x9f" + b"\x80" * 200_000
    assert refused(Conversation().receive(endless, is_text=False)) is FrameFault.TOO_LARGE


def test_a_frame_with_too_many_values_is_refused_unread() -> None:
    names = frame({"op": "publish", "topic": "/x", "msg": {"a": [None] * 500_000}})
    assert refused(Conversation().receive(names, is_text=True)) is FrameFault.TOO_LARGE
    assert (
        refused(Conversation().receive(cbor2.dumps([None] * 500_000), is_text=False))
        is FrameFault.TOO_LARGE
    )


def test_a_list_that_claims_to_be_longer_than_its_frame_is_refused() -> None:
    claim = b"\x9b" + (2**60).to_bytes(8) + b"\x00" * 20_000
    assert refused(Conversation().receive(claim, is_text=False)) is FrameFault.NO_CBOR


def test_a_large_path_is_read_in_json_and_in_cbor() -> None:
    point = {"position": {"x": 1.5, "y": 2.5, "z": 0.0}, "orientation": {"w": 1.0}}
    poses = [{"header": {"frame_id": "map"}, "pose": point}] * 10_000
    path = {"op": "publish", "topic": "/plan", "msg": {"poses": poses}}
    assert published(Conversation().receive(frame(path), is_text=True)).values == {"poses": poses}
    event = Conversation().receive(cbor2.dumps(path), is_text=False)
    assert published(event).values == {"poses": poses}


@pytest.mark.parametrize("tail", [b'\\"' * 100_000, b"nan " * 100_000, b'"nan' * 100_000])
@pytest.mark.parametrize("end", [b"", b"\\", b'"'])
def test_a_text_without_an_end_is_read_once(tail: bytes, end: bytes) -> None:
    text = b'x"' + tail + end
    n_read = sum(len(found[0]) for found in BARE_NUMBER.finditer(text))
    strings = [found for found in BARE_NUMBER.finditer(text) if found[0][:1] == b'"']
    assert n_read <= len(text)
    assert strings[-1].end() == len(text) or strings[-1][0][-1:] == b'"'
    assert refused(Conversation().receive(text, is_text=True)) is FrameFault.NO_JSON


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_velocity_that_is_no_number_never_reaches_the_robot(number: float) -> None:
    with pytest.raises(LinkError, match="finite"):
        write_operation("publish", topic="/cmd_vel", msg={"linear": {"x": number}})
    with pytest.raises(LinkError, match="NaN"):
        write_operation("publish", topic="/scan", msg={"ranges": np.array([number])})


@pytest.mark.parametrize("name", ["", "/", "no spaces", "/a//b", "/1", "/a;b", "\x00"])
def test_a_name_that_ros_does_not_take_is_refused_before_it_is_sent(name: str) -> None:
    with pytest.raises(LinkError, match="not the name"):
        write_operation("publish", topic=name, msg={})


def test_a_subscription_says_what_the_server_needs_and_no_fragment_size() -> None:
    text = write_operation(
        "subscribe",
        id="one",
        topic="/map",
        type="nav_msgs/msg/OccupancyGrid",
        compression=Encoding.CBOR.value,
        throttle_rate=None,
    )
    assert orjson.loads(text) == {
        "op": "subscribe",
        "id": "one",
        "topic": "/map",
        "type": "nav_msgs/msg/OccupancyGrid",
        "compression": "cbor",
    }


def test_ids_are_never_the_same() -> None:
    assert len({new_id() for _ in range(1_000)}) == 1_000


OPERATIONS = st.sampled_from(
    ["publish", "service_response", "action_feedback", "action_result", "status", "fragment", "png"]
)
LEAVES = st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text()
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8
)
FRAMES = st.fixed_dictionaries(
    {},
    optional={
        "op": OPERATIONS | VALUES,
        "id": VALUES,
        "topic": VALUES,
        "msg": VALUES,
        "values": VALUES,
        "status": VALUES,
        "result": VALUES,
        "num": VALUES | st.integers(0, 3),
        "total": VALUES | st.integers(1, 4),
        "data": VALUES,
        "level": VALUES,
    },
)


def check_that_it_is_an_event(event: Event | None) -> None:
    assert event is None or isinstance(event, Event)


@settings(max_examples=100)
@given(st.lists(FRAMES, max_size=6))
def test_any_operation_gives_an_event_and_never_an_exception(
    operations: list[dict[str, Any]],
) -> None:
    conversation = Conversation(max_bytes=10_000)
    for operation in operations:
        check_that_it_is_an_event(
            conversation.receive(json.dumps(operation).encode(), is_text=True)
        )
        check_that_it_is_an_event(conversation.receive(cbor2.dumps(operation), is_text=False))
        assert conversation.fragments.n_bytes <= 10_000


@settings(max_examples=100)
@given(st.lists(st.binary(max_size=60), max_size=60))
def test_any_bytes_give_an_event_and_never_an_exception(frames: list[bytes]) -> None:
    conversation = Conversation(max_bytes=10_000)
    for each in frames:
        check_that_it_is_an_event(conversation.receive(each, is_text=True))
        check_that_it_is_an_event(conversation.receive(each, is_text=False))


@settings(max_examples=100)
@given(st.integers(0, 10**6), st.lists(st.integers(0, 255), min_size=1, max_size=4))
def test_a_damaged_frame_gives_an_event_and_never_an_exception(
    place: int, damage: list[int]
) -> None:
    conversation = Conversation()
    map_message = {"op": "publish", "topic": "/map", "msg": {"data": cbor2.CBORTag(72, b"abc")}}
    for whole, receive in (
        (frame(HELLO), partial(conversation.receive, is_text=True)),
        (pieces_of(json.dumps(HELLO), 2)[0], partial(conversation.receive, is_text=True)),
        (cbor2.dumps(map_message), partial(conversation.receive, is_text=False)),
    ):
        start = place % len(whole)
        spoilt = whole[:start] + bytes(damage) + whole[start + len(damage) :]
        check_that_it_is_an_event(receive(spoilt))
        check_that_it_is_an_event(receive(whole[:start]))


def test_only_a_small_frame_with_nothing_wrapped_in_it_is_light() -> None:
    conversation = Conversation()
    assert conversation.is_light(frame(HELLO))
    assert not conversation.is_light(frame(HELLO) + b" " * LIGHT_BYTES)
    assert not conversation.is_light(pieces_of(json.dumps(HELLO), 1)[0])
    assert not conversation.is_light(b'{"op": "fr\\u0061gment", "data": ""}')


def test_of_many_unfinished_messages_the_oldest_are_forgotten_however_small_they_are() -> None:
    store = FragmentStore()
    for number in range(20):
        store.add({"id": str(number), "num": 0, "total": 2, "data": "x" * 10})
    assert store.n_bytes == 10 * MAX_UNFINISHED
    assert store.add({"id": "0", "num": 1, "total": 2, "data": "y"}) is None
    assert store.add({"id": "19", "num": 1, "total": 2, "data": "y"}) == b"x" * 10 + b"y"
