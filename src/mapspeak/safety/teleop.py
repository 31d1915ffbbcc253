"""Published velocities: where they would take the robot, and whether it may go there."""

import math
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import anyio

from mapspeak.errors import LinkError, NextStep
from mapspeak.geometry import Point, Pose
from mapspeak.robot import Robot
from mapspeak.ros.messages.poses import Twist
from mapspeak.safety.deciding import Refused, find_speeds, refuse
from mapspeak.safety.guard import MapReviser
from mapspeak.safety.monitor import (
    BRAKING_MPS2,
    KEEP_M,
    REACTION_S,
    comes_too_near,
    follow_arc,
)
from mapspeak.safety.planning import Planner

LEAST_S = 0.5
"""How long one message moves the robot: about as long as base drivers wait for the next."""
FASTEST = 1_000.0
"""In m/s or rad/s, more than a policy allows."""
STEP_M = 0.05
MOST_STEPS = 400

Message = Mapping[str, Any]

# State of a task, not of the module: until when its present publication goes on, in wall time.
_UNTIL_S: ContextVar[float] = ContextVar("publishing_until", default=-math.inf)


@contextmanager
def publishing_for(duration_s: float) -> Generator[None]:
    """Say that what is published in the `with` block is repeated for `duration_s`."""
    token = _UNTIL_S.set(anyio.current_time() + duration_s)
    try:
        yield
    finally:
        _UNTIL_S.reset(token)


class Teleop:
    """Knows the velocities that were published, and judges those that are to be."""

    def __init__(self, robot: Robot, *, planner: Planner, reviser: MapReviser) -> None:
        self._robot = robot
        self._planner = planner
        self._reviser = reviser
        self._moving: set[str] = set()

    @property
    def knows_areas(self) -> bool:
        """True when there is anything that may be closed, now or at another hour."""
        return self._reviser.has_rules

    @property
    def is_under_way(self) -> bool:
        """True from a velocity on until zero velocity was published on its topic."""
        return bool(self._moving)

    async def find_objection(self, message: Message) -> Refused | None:
        """Return which closed area a velocity would take the robot into; None where into none.

        An unknown pose counts as an objection.
        """
        if not self._reviser.has_rules or not _is_moving(message):
            return None
        try:
            here = (await self._robot.fetch_pose()).pose
            await self._planner.revise_lately()
        except LinkError as error:
            return refuse_velocity(
                "The policy closes areas, and where the robot is cannot be known now: "
                f"{error.message}"
            )
        return self._find_objection(message, here)

    def begin(self, topic: str) -> None:
        """Note that a velocity is let go."""
        self._moving.add(topic)

    def end(self, topic: str) -> None:
        """Note that zero velocity was published."""
        self._moving.discard(topic)

    def end_all(self) -> None:
        """Note that the robot was stopped."""
        self._moving.clear()

    def _find_objection(self, message: Message, here: Pose) -> Refused | None:
        revision = self._reviser.latest
        if revision is None:
            return None
        areas, radius_m = revision.areas, revision.radius_m
        lasts_s = max(LEAST_S, _UNTIL_S.get() - anyio.current_time()) + REACTION_S
        velocity = _read_velocity(message)
        if velocity is None:
            speeds = (speed for part, speed in find_speeds(message) if part != "angular")
            fastest_mps = max(speeds, default=0.0)
            reach_m = _reach_m(fastest_mps, lasts_s) + radius_m
            entered = next((each for each in areas if each.distance_to(here.point) < reach_m), None)
        else:
            way = _predict(here, velocity, lasts_s)
            near_m = radius_m + KEEP_M
            near = (each for each in areas if comes_too_near(each, here.point, way, reach_m=near_m))
            entered = next(near, None)
        if entered is None:
            return None
        off_m = max(entered.distance_to(here.point) - radius_m, 0.0)
        return refuse_velocity(
            f"This velocity would take the robot into the {entered.title}, {off_m:.2f} m from its "
            f"edge, within {lasts_s:.1f} s."
        )


def refuse_velocity(message: str) -> Refused:
    """Return the refusal of a velocity for where it leads."""
    hint = "Publish a velocity that leads away."
    return refuse(message, rule="keep_out", hint=hint, step=NextStep.DRIVE_ROUND)


def zero_velocity_of(message: Message) -> dict[str, Any]:
    """Return a velocity message with every number at zero; header and texts stay."""
    return {name: value if name == "header" else _zero_of(value) for name, value in message.items()}


def is_zero_velocity(message: Message) -> bool:
    """Return True when a velocity says that the robot stands, with every field at zero.

    A speed of zero with an acceleration or a steering angle does not count.
    """
    return any(True for _ in find_speeds(message)) and _is_zero(message)


def _is_zero(value: object) -> bool:
    match value:
        case Mapping():
            return all(name == "header" or _is_zero(each) for name, each in value.items())
        case int() | float():
            return value == 0
        case _:
            return False


def _zero_of(value: Any) -> Any:  # noqa: ANN401 - ROS JSON
    match value:
        case bool() | str():
            return value
        case int() | float():
            return type(value)(0)
        case Mapping():
            return zero_velocity_of(value)
        case list():
            return [_zero_of(each) for each in value]
        case _:
            return value


def _is_moving(message: Message) -> bool:
    """Return True for a message with speeds; those that no policy allows are refused elsewhere."""
    speeds = [speed for _, speed in find_speeds(message)]
    return any(speeds) and all(speed <= FASTEST for speed in speeds)


def _read_velocity(message: Message) -> Twist | None:
    """Return the velocity of a Twist or TwistStamped; None for all that holds other speeds."""
    twist = message.get("twist", message)
    parts = {"linear", "angular"} & twist.keys() if isinstance(twist, Mapping) else set()
    if not parts or len(parts) != len(list(find_speeds(message))):
        return None
    linear, angular = twist.get("linear", {}), twist.get("angular", {})
    return Twist(
        forward_mps=float(linear.get("x", 0.0)),
        left_mps=float(linear.get("y", 0.0)),
        turn_radps=float(angular.get("z", 0.0)),
    )


def _reach_m(speed_mps: float, lasts_s: float) -> float:
    """Return how far a robot gets until it stands."""
    return speed_mps * lasts_s + speed_mps**2 / (2 * BRAKING_MPS2)


def _predict(here: Pose, velocity: Twist, lasts_s: float) -> tuple[Point, ...]:
    """Return points on the way until the robot stands, the velocity held until it brakes."""
    speed_mps = math.hypot(velocity.forward_mps, velocity.left_mps)
    if speed_mps == 0.0:
        return ()
    length_m = _reach_m(speed_mps, lasts_s)
    n_steps = min(math.ceil(length_m / STEP_M), MOST_STEPS)
    heading_rad = here.yaw_rad + math.atan2(velocity.left_mps, velocity.forward_mps)
    curvature_radpm = velocity.turn_radps / speed_mps
    return follow_arc(here.point, heading_rad, curvature_radpm, length_m, n_steps=n_steps)
