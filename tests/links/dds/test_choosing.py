"""--robot dds, as the command line understands it."""

import importlib.util
import sys

import anyio
import pytest

from mapspeak.cli.shared.robots import RobotChoice, open_robot, read_network
from mapspeak.errors import ConfigError


def open_and_close(choice: RobotChoice) -> None:
    async def run() -> None:
        async with open_robot(choice):
            pass

    anyio.run(run)


def test_without_the_library_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    with pytest.raises(ConfigError, match=r"pip install (.* )?'cyclonedds"):
        open_and_close(RobotChoice(robot="dds"))


@pytest.mark.parametrize(
    "choice",
    [
        RobotChoice(robot="dds", clock="virtual"),
        RobotChoice(robot="dds:3", has_detector=True),
    ],
)
def test_the_simulators_options_are_refused(choice: RobotChoice) -> None:
    with pytest.raises(ConfigError, match="for the simulated robot"):
        open_and_close(choice)


needs_library = pytest.mark.skipif(
    importlib.util.find_spec("cyclonedds") is None, reason="has no wheel for this Python"
)


@needs_library
@pytest.mark.parametrize("domain", ["-1", "233", "two", "²"])
def test_what_is_no_domain_is_an_error(domain: str) -> None:
    with pytest.raises(ConfigError, match="no ROS domain"):
        open_and_close(RobotChoice(robot=f"dds:{domain}"))


@needs_library
def test_the_domain_is_the_one_given_or_that_of_the_environment() -> None:
    environment = {"ROS_DOMAIN_ID": "7"}
    assert read_network("", {}).domain_id == 0
    assert read_network("", environment).domain_id == 7
    assert read_network("42", environment).domain_id == 42


@needs_library
def test_a_robot_that_keeps_to_this_machine_is_looked_for_here_only() -> None:
    assert not read_network("", {}).is_local
    assert read_network("", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}).is_local
    assert read_network("", {"ROS_LOCALHOST_ONLY": "1"}).is_local


@needs_library
def test_robots_that_multicast_does_not_reach_are_named() -> None:
    network = read_network("", {"ROS_STATIC_PEERS": "192.168.1.20; robot.local"})
    assert network.peers == ("192.168.1.20", "robot.local")
    assert '<Peer address="192.168.1.20"/>' in network.configuration
