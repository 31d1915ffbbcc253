"""What the robot hears of our publishing, and when."""

import pytest

from mapspeak.ros.link import Advertising


class Told(Advertising):
    """A link that keeps what it would tell the robot."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[str] = []

    def _check(self, topic: str, type_name: str | None) -> None:
        """Take every name and type."""

    def _announce(self, topic: str, type_name: str, is_latched: bool) -> None:  # noqa: ARG002, FBT001
        self.told.append(f"{topic} {type_name}")

    def _take_back(self, topic: str) -> None:
        self.told.append(f"{topic} gone")

    def publish_first(self, topic: str) -> bool:
        return self._tell_first(topic)


@pytest.fixture
def link() -> Told:
    return Told()


def test_a_topic_is_told_at_once_from_the_beginning(link: Told) -> None:
    link.advertise("/news", type_name="a/B")
    assert link.told == ["/news a/B"]
    assert not link.publish_first("/news")


def test_for_one_that_is_watched_it_is_told_with_the_first_message(link: Told) -> None:
    link.advertise_late()
    link.advertise("/news", type_name="a/B")
    assert link.told == []
    assert link.publish_first("/news")
    assert not link.publish_first("/news")
    assert link.told == ["/news a/B"]


def test_whoever_may_drive_tells_all_that_was_kept_back(link: Told) -> None:
    link.advertise_late()
    link.advertise("/news", type_name="a/B")
    link.advertise_early()
    link.advertise("/more", type_name="a/C")
    link.advertise_early()
    assert link.told == ["/news a/B", "/more a/C"]


def test_what_the_robot_never_heard_of_is_not_taken_back(link: Told) -> None:
    link.advertise_late()
    link.advertise("/news", type_name="a/B")
    link.unadvertise("/news")
    assert link.told == []
    link.advertise_early()
    link.advertise("/more", type_name="a/C")
    link.unadvertise("/more")
    assert link.told == ["/more a/C", "/more gone"]
    assert not link.publish_first("/more")
