"""What every link promises, held by links/dds with a robot on real ROS 2."""

from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager

import pytest

from contracts import test_robot as promises
from mapspeak.cli.robots import read_network
from mapspeak.robot import Robot
from ros2.conftest import START, TWO_ROOMS
from ros2.robot_process import RobotProcess, open_robot_process

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

pytestmark = [pytest.mark.ros2, pytest.mark.anyio]

SPEED_MPS = 0.4


@pytest.fixture
def slow_robot(domain: dict[str, str]) -> Iterator[RobotProcess]:
    with open_robot_process(
        TWO_ROOMS, pose=START, speed_mps=SPEED_MPS, environment=domain
    ) as process:
        yield process


@pytest.fixture
def open_robot(
    slow_robot: RobotProcess,
) -> Callable[[], AbstractAsyncContextManager[Robot]]:
    from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional

    @asynccontextmanager
    async def open_linked() -> AsyncGenerator[Robot]:
        async with open_dds_robot(read_network("", slow_robot.environment)) as robot:
            yield robot

    return open_linked


# The same functions, with this robot.
globals().update({name: test for name, test in vars(promises).items() if name.startswith("test_")})
