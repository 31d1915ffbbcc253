"""Several robots on one command line."""

from pathlib import Path

import pytest

from mapspeak.cli.shared.robots import file_for, name_robots, split_files
from mapspeak.errors import ConfigError

TWO = {"hall": "ws://10.0.0.1:9090", "yard": "sim:office"}


def test_a_single_robot_needs_no_name() -> None:
    assert name_robots(["ws://10.0.0.1:9090"]) == {"": "ws://10.0.0.1:9090"}


def test_a_single_robot_may_have_one() -> None:
    assert name_robots(["hall=sim"]) == {"hall": "sim"}


def test_several_robots_go_by_their_names() -> None:
    assert name_robots(["hall=ws://10.0.0.1:9090", "yard=sim:office"]) == TWO


def test_an_equals_sign_in_an_address_is_no_name() -> None:
    assert name_robots(["wss://robots.example/?id=7"]) == {"": "wss://robots.example/?id=7"}


@pytest.mark.parametrize(
    ("given", "said"),
    [(["sim", "yard=sim"], "'sim' has no name"), (["a=sim", "a=sim"], "Two robots are called 'a'")],
)
def test_names_that_are_missing_or_taken_are_said(given: list[str], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        name_robots(given)


def test_a_file_is_for_the_robot_it_names_and_one_without_a_name_for_the_rest() -> None:
    files = split_files(["yard=yard.yaml", "all.yaml"], TWO, "--robot-file")
    assert file_for("yard", files) == Path("yard.yaml")
    assert file_for("hall", files) == Path("all.yaml")
    assert file_for("hall", {}) is None


def test_a_file_for_nobody_is_refused() -> None:
    with pytest.raises(ConfigError, match="no robot called 'barn'"):
        split_files(["barn=barn.yaml"], TWO, "--robot-file")


def test_a_file_of_a_single_robot_may_have_an_equals_sign_in_its_name() -> None:
    files = split_files(["a=b.yaml"], {"": "sim"}, "--robot-file")
    assert file_for("", files) == Path("a=b.yaml")


def test_two_files_for_one_robot_are_refused() -> None:
    with pytest.raises(ConfigError, match="given twice for yard"):
        split_files(["yard=a.yaml", "yard=b.yaml"], TWO, "--policy")
