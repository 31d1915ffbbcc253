"""A robot that may not be there yet: looked for in the background, and shared by all callers.

A link reconnects a robot that was found once; this module waits for the first time.
"""

import inspect
import logging
import time
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Any, cast

import anyio

from mapspeak.errors import LinkError
from mapspeak.robot import Robot
from mapspeak.ros.activity import News, Started
from mapspeak.ros.port import RosConnection
from mapspeak.ros.robot import RosRobot

PAUSE_S = 2.0
"""Between two looks for a robot without requests for it."""
FIRST_LOOK_S = 15.0
"""For how long a call waits for the first look to end, when nothing is known of the robot yet."""
LOOK_S = 1.0
"""For how long a call waits for a later one."""
STAYS = "mapspeak goes on looking and connects by itself: nothing has to be started again."

logger = logging.getLogger(__name__)


class Arrival:
    """Opens a link again and again until its robot is there.

    Args:
        open_robot: Opens the link; raises `LinkError` where the robot cannot be reached.

    Attributes:
        there: The robot itself; None while it is not there.
    """

    def __init__(self, open_robot: Callable[[], AbstractAsyncContextManager[RosRobot]]) -> None:
        self._open_robot = open_robot
        self.there: RosRobot | None = None
        self._fault: LinkError | None = None
        self._has_looked = News()
        self._is_wanted = anyio.Event()
        self._is_early = False
        # Both ports are large, and every method of them is passed on in the same way.
        self.robot = cast("Robot", LateRobot(Robot, self, lambda there: there))
        self.connection = cast(
            "RosConnection", LateConnection(RosConnection, self, lambda there: there.connection)
        )

    async def keep_looking(self) -> None:
        """Look for the robot until it is there, and keep its link open, until cancelled."""
        while True:
            try:
                async with self._open_robot() as robot:
                    if self._is_early:
                        robot.connection.advertise_early()
                    self._tell(robot, None)
                    await anyio.sleep_forever()
            except LinkError as error:
                self._tell(None, error)
            with anyio.move_on_after(PAUSE_S):
                await self._is_wanted.wait()
            self._is_wanted = anyio.Event()

    async def wait(self) -> RosRobot:
        """Return the robot, once a look for it has ended.

        Raises:
            LinkError: It is not there; says why.
        """
        if self.there is None:
            self._is_wanted.set()
            with anyio.move_on_after(FIRST_LOOK_S if self._fault is None else LOOK_S):
                await self._has_looked.wait()
        return self.reach()

    def reach(self) -> RosRobot:
        """Return the robot.

        Raises:
            LinkError: It is not there; says why.
        """
        if self.there is not None:
            return self.there
        if self._fault is None:
            raise LinkError("The robot is not there yet: it is being looked for.", hint=STAYS)
        raise LinkError(
            f"The robot is not there yet. {self._fault.message}", hint=f"{self._fault.hint} {STAYS}"
        )

    def advertise_early(self) -> None:
        """Advertise the topics that stop the robot as soon as it is there."""
        self._is_early = True
        if self.there is not None:
            self.there.connection.advertise_early()

    def _tell(self, robot: RosRobot | None, fault: LinkError | None) -> None:
        if robot is not None:
            logger.warning("The robot is there.")
        elif self._fault is None or str(self._fault) != str(fault):
            logger.warning("The robot is not there yet. %s", fault)
        self.there, self._fault = robot, fault
        self._has_looked.tell()


class LatePort:
    """Passes all calls on to the implementation of a port, once that is there.

    Args:
        select: Returns the implementation, of a robot that is there.
    """

    def __init__(self, port: type, arrival: Arrival, select: Callable[[RosRobot], object]) -> None:
        self._port = port
        self._arrival = arrival
        self._select = select

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - any member of the port
        """Return a member of the port; one that is awaited waits for the robot first."""
        if not inspect.iscoroutinefunction(getattr(self._port, name, None)):
            return getattr(self._select(self._arrival.reach()), name)

        async def call(*arguments: Any, **named: Any) -> Any:  # noqa: ANN401 - as the port has it
            there = self._select(await self._arrival.wait())
            return await getattr(there, name)(*arguments, **named)

        return call


class LateRobot(LatePort):
    """A `Robot` whose time is that of this machine until it is there."""

    @property
    def now_s(self) -> float:
        """Robot time."""
        there = self._arrival.there
        return time.time() if there is None else there.now_s

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""
        there = self._arrival.there
        await (anyio.sleep(duration_s) if there is None else there.sleep(duration_s))


class LateConnection(LatePort):
    """A `RosConnection` whose purpose can be set before it is there."""

    @property
    def started(self) -> Started:
        """Everything that was started over this connection: nothing before it is there."""
        there = self._arrival.there
        return Started() if there is None else there.connection.started

    def advertise_early(self) -> None:
        """Advertise the topics that stop the robot as soon as it is there."""
        self._arrival.advertise_early()
