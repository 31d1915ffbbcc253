"""A world with one robot, stepped by hand: no clock, no network, no port."""

from mapspeak.simulator.camera.camera import CAMERAS, HORIZONTAL_FOV_RAD, measure_shares_in_view
from mapspeak.simulator.robot.controller import KEEP_OFF_M
from mapspeak.simulator.robot.equipment import Equipment
from mapspeak.simulator.robot.lidar import BEAM_ANGLES_RAD, MAX_RANGE_M, LidarScan
from mapspeak.simulator.robot.physics import MAX_SPEED_MPS, MAX_TURN_RADPS, BodyVelocity
from mapspeak.simulator.simulation import (
    TICK_S,
    Simulation,
    StateLog,
    StateRecord,
    read_state_log,
)
from mapspeak.simulator.truth import (
    EyeLevel,
    MeasuredRoom,
    TrueFloor,
    Truth,
    is_in_sight,
)
from mapspeak.simulator.worlds.world import (
    BODY_RADIUS_M,
    TrueRoom,
    World,
    WorldDoor,
    WorldObject,
    WorldWall,
)
from mapspeak.simulator.worlds.worldfiles import load_world, world_names

__all__ = [
    "BEAM_ANGLES_RAD",
    "BODY_RADIUS_M",
    "CAMERAS",
    "HORIZONTAL_FOV_RAD",
    "KEEP_OFF_M",
    "MAX_RANGE_M",
    "MAX_SPEED_MPS",
    "MAX_TURN_RADPS",
    "TICK_S",
    "BodyVelocity",
    "Equipment",
    "EyeLevel",
    "LidarScan",
    "MeasuredRoom",
    "Simulation",
    "StateLog",
    "StateRecord",
    "TrueFloor",
    "TrueRoom",
    "Truth",
    "World",
    "WorldDoor",
    "WorldObject",
    "WorldWall",
    "is_in_sight",
    "load_world",
    "measure_shares_in_view",
    "read_state_log",
    "world_names",
]
