"""What the robot hears of our publishing, and when."""

import pytest

from mapspeak.ros.link import Announcements


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def announcements(told: list[str]) -> Announcements:
    return Announcements(
        lambda topic, type_name, _is_latched: told.append(f"{topic} {type_name}"),
        lambda topic: told.append(f"{topic} gone"),
    )


def test_a_topic_is_told_at_once_from_the_beginning(
    announcements: Announcements, told: list[str]
) -> None:
    announcements.advertise("/news", "a/B")
    assert told == ["/news a/B"]
    assert not announcements.use("/news")


def test_for_one_that_is_watched_it_is_told_with_the_first_message(
    announcements: Announcements, told: list[str]
) -> None:
    announcements.be_late()
    announcements.advertise("/news", "a/B")
    assert (told, announcements.told) == ([], frozenset())
    assert announcements.use("/news")
    assert not announcements.use("/news")
    assert told == ["/news a/B"]


def test_whoever_may_drive_tells_all_that_was_kept_back(
    announcements: Announcements, told: list[str]
) -> None:
    announcements.be_late()
    announcements.advertise("/news", "a/B")
    announcements.be_early()
    announcements.advertise("/more", "a/C")
    announcements.be_early()
    assert told == ["/news a/B", "/more a/C"]


def test_what_the_robot_never_heard_of_is_not_taken_back(
    announcements: Announcements, told: list[str]
) -> None:
    announcements.be_late()
    announcements.advertise("/news", "a/B")
    announcements.unadvertise("/news")
    assert told == []
    announcements.be_early()
    announcements.advertise("/more", "a/C")
    announcements.unadvertise("/more")
    assert told == ["/more a/C", "/more gone"]
    assert not announcements.use("/more")
