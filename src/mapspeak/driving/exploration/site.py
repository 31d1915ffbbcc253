"""What exploring and searching need of whoever holds the robot."""

from collections.abc import Callable
from typing import Protocol, TypeVar

from mapspeak.driving.drive import DriveBook
from mapspeak.robot import Robot
from mapspeak.worldmodel.model import Atlas

__all__ = ["Site"]

T = TypeVar("T")


class Site(Protocol):
    """A robot, its drives, and the map as it is now; a session is one."""

    @property
    def robot(self) -> Robot:
        """The port to the robot."""
        ...

    @property
    def drives(self) -> DriveBook:
        """Every drive of the robot."""
        ...

    async def fetch_atlas(self) -> Atlas:
        """Gives the map as it is now, with everything on it under its id."""
        ...

    async def compute(self, work: Callable[[], T]) -> T:
        """Does heavy work so that a stop is answered meanwhile."""
        ...
