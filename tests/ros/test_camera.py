"""How long a picture is waited for."""

from dataclasses import replace

import pytest

from mapspeak.errors import LinkError
from mapspeak.ros.link import Patience
from mapspeak.ros.robot.sensors import RosCamera
from rosbridge_robot import ScriptedRobot, connect_scripted

pytestmark = pytest.mark.anyio

QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
PATIENCE = replace(QUICK, settling_s=0.0, picture_s=0.1, first_picture_s=0.2)
TOPIC = "/camera/image_raw"


@pytest.mark.parametrize(("is_dead", "first_s"), [(False, 0.2), (True, 0.1)])
async def test_a_camera_that_is_published_is_waited_for_longer_but_once(
    is_dead: bool,  # noqa: FBT001 - a case
    first_s: float,
) -> None:
    scripted = ScriptedRobot()
    scripted.topics[TOPIC] = "sensor_msgs/msg/Image"
    async with connect_scripted(scripted, patience=PATIENCE) as robot:
        dead = frozenset({TOPIC}) if is_dead else frozenset[str]()
        profile = replace(robot.profile, dead_topics=dead)
        camera = RosCamera(robot.connection, profile, profile.cameras[0])
        for waited_s in (first_s, 0.1):
            with pytest.raises(LinkError, match=f"within {waited_s:g} s"):
                await camera.fetch()
