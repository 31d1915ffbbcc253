"""The simulated robot behind the port."""

import asyncio
import threading
from contextlib import suppress

import numpy as np
import pytest
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.simulator import CAMERAS, Simulation
from roaming import world_from_text

pytestmark = pytest.mark.anyio

ROOM = "\n".join(["#" * 24, *["#" + "." * 22 + "#"] * 12, "#" * 24])


class GoingOn(Simulation):
    """A world that goes on while a picture is drawn, as on a real clock."""

    def take_picture(self, camera: str = next(iter(CAMERAS))) -> NDArray[np.uint8]:
        picture = super().take_picture(camera)
        for _ in range(40):
            self.step()
        return picture


async def test_a_picture_is_of_where_the_robot_stood_when_it_was_begun() -> None:
    simulation = GoingOn(world_from_text(ROOM, start=(1.5, 1.5)), seed=1)
    robot = SimulatedRobot(simulation, has_detector=False)
    await robot.send_goal(Pose(2.0, 0.0))
    await robot.sleep(1.0)
    before = await robot.fetch_pose()
    picture = await robot.fetch_picture()
    after = await robot.fetch_pose()
    assert picture.pose == before.pose
    assert picture.stamp_s == before.stamp_s
    assert after.pose.point.distance_to(before.pose.point) > 0.1


def test_what_an_ended_event_loop_left_running_is_waited_for() -> None:
    robot = SimulatedRobot(
        Simulation(world_from_text(ROOM, start=(1.5, 1.5)), seed=1), has_detector=False
    )
    begun, may_end = threading.Event(), threading.Event()
    ended: list[str] = []

    def step() -> None:
        begun.set()
        may_end.wait()
        ended.append("step")

    async def be_interrupted() -> None:
        stepping = asyncio.ensure_future(robot.compute(step))
        await asyncio.to_thread(begun.wait)
        stepping.cancel()
        with suppress(asyncio.CancelledError):
            await stepping
        after = threading.Thread(target=robot.work_alone, args=(lambda: ended.append("map"),))
        after.start()
        may_end.set()
        await asyncio.to_thread(after.join)

    asyncio.run(be_interrupted())
    assert ended == ["step", "map"]
