"""What waits for a client of the rosbridge server: in order, bounded, and not too often."""

import pytest

from mapspeak.rosbridge_server.hub import Frame, Lane, Outbox, Publication

pytestmark = pytest.mark.anyio


def numbered(number: int, topic: str = "/news") -> Publication:
    return Publication(topic, "std_msgs/Int32", {"data": number})


def taken_from(lane: Lane, now_s: float) -> list[int]:
    numbers = []
    while (item := lane.take(now_s)) is not None:
        assert isinstance(item, Publication)
        numbers.append(item.message["data"])
    return numbers


def test_when_too_much_waits_the_oldest_goes() -> None:
    lane = Lane(depth=2, throttle_s=0.0, holds_back=False)
    for number in range(4):
        lane.offer(numbered(number), 0.0)
    assert taken_from(lane, 0.0) == [2, 3]


def test_a_throttled_topic_drops_what_comes_too_early() -> None:
    lane = Lane(depth=10, throttle_s=1.0, holds_back=False)
    for number, now_s in enumerate((0.0, 0.4, 0.8, 1.2, 1.6)):
        lane.offer(numbered(number), now_s)
    assert taken_from(lane, 2.0) == [0, 3]


def test_a_throttled_topic_with_a_queue_sends_the_rest_later() -> None:
    lane = Lane(depth=2, throttle_s=1.0, holds_back=True)
    for number in range(3):
        lane.offer(numbered(number), 0.0)
    assert [taken_from(lane, now_s) for now_s in (0.0, 0.5, 1.0, 2.0)] == [[1], [], [2], []]


async def test_answers_come_first_and_all_of_them() -> None:
    outbox = Outbox(give_up=lambda: None)
    outbox.open_lane("/news", depth=1, throttle_s=0.0, holds_back=False)
    answers = [Frame(b"one", is_text=True), Frame(b"two", is_text=True)]
    for number, answer in enumerate(answers):
        outbox.hear(numbered(number))
        outbox.reply(answer)
    first, second, news = await outbox.take()
    assert [first, second] == answers
    assert isinstance(news, Publication)
    assert news.message["data"] == 1


def test_a_client_that_asks_and_never_reads_is_given_up() -> None:
    given_up: list[bool] = []
    outbox = Outbox(give_up=lambda: given_up.append(True))
    for _ in range(1000):
        outbox.reply(Frame(b"answer", is_text=True))
    assert given_up == []
    outbox.reply(Frame(b"answer", is_text=True))
    assert given_up == [True]
