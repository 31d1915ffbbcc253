"""Small worlds for the camera: one room with what a test puts in it."""

import math
from collections.abc import Sequence

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.worlds.world import TrueRoom, World, WorldDoor, WorldObject, WorldWall
from mapspeak.spatial.rooms import RoomClass

ROOM_LENGTH_M = 8.0
ROOM_WIDTH_M = 6.0
END_WALL = Pose(ROOM_LENGTH_M, ROOM_WIDTH_M / 2, math.pi)
"""The middle of the wall at the far end, facing into the room."""
START = Pose(1.0, ROOM_WIDTH_M / 2, 0.0)
"""In the middle of the near end, looking at the far one."""


def make_wall(start: tuple[float, float], end: tuple[float, float]) -> WorldWall:
    return WorldWall(start=Point(*start), end=Point(*end), thickness_m=0.1, height_m=2.8)


def make_room(
    *things: tuple[str, Pose], walls: Sequence[WorldWall] = (), doors: Sequence[WorldDoor] = ()
) -> World:
    """Gives a room of 8 x 6 m with things of the given kinds; its inner faces are at 0 and 8, 6."""
    corners = (
        (-0.05, -0.05),
        (ROOM_LENGTH_M + 0.05, -0.05),
        (ROOM_LENGTH_M + 0.05, ROOM_WIDTH_M + 0.05),
        (-0.05, ROOM_WIDTH_M + 0.05),
    )
    around = [make_wall(corners[i], corners[(i + 1) % 4]) for i in range(4)]
    outline = tuple(Point(*corner) for corner in corners)
    objects = (
        WorldObject(name=f"{kind} {i}", kind=kind, pose=pose)
        for i, (kind, pose) in enumerate(things)
    )
    return World(
        name="stage",
        title="One room.",
        walls=(*around, *walls),
        objects=tuple(objects),
        rooms=(TrueRoom(name="room", room_class=RoomClass.ROOM, outline=outline),),
        start=START,
        doors=tuple(doors),
    )
