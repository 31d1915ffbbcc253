"""THE PORT: what mapspeak asks of a robot, and the values that cross.

A link (`mapspeak.links`) implements `Robot`; everything above it sees nothing else of the robot.
Time is the robot's own: a simulated robot may run faster than the wall clock.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid

OLD_POSE_S = 3.0
"""An older pose does not tell where the robot is: it may have driven on."""
SCAN_PATIENCE_S = 0.5
"""The longest wait for a scan, in wall time: it is only additional evidence."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotDescription:
    """What is fixed about a robot while it is connected.

    Attributes:
        radius_m: Of the smallest circle around it.
        map_name: Which map or building it drives in, as far as the robot can tell.
        cameras: Their names, first the one that looks ahead: a drive for a picture turns it there.
        has_laser: It has a laser that measures along the floor; whether that turns is not said.
        detector: What its own object detector is called; None where it has none.
        map_frame: What ROS calls the frame of its map.
        is_radius_assumed: Neither the robot nor its owner has told the radius.
    """

    name: str
    radius_m: float
    map_name: str
    cameras: tuple[str, ...]
    has_laser: bool
    detector: str | None
    map_frame: str = "map"
    is_radius_assumed: bool = False

    @property
    def has_camera(self) -> bool:
        """True where it has a camera."""
        return bool(self.cameras)

    def find_camera(self, said: str) -> str:
        """Return the name of a camera, as it is written.

        Raises:
            LinkError: The robot has no such camera; the hint names those that it has.
        """
        wanted = said.strip().casefold()
        found = next((name for name in self.cameras if name.casefold() == wanted), None)
        if found is None:
            known = ", ".join(self.cameras) or "it has none"
            raise LinkError(f"The robot has no camera {said[:80]!r}.", hint=f"Cameras: {known}.")
        return found


class PoseDoubt(StrEnum):
    """Why a robot may not be where it is said to be."""

    NO_ANSWER = "no_answer"
    NO_POSE = "no_pose"
    OLD_POSE = "old_pose"
    SILENT_POSE = "silent_pose"
    CLOCK_STANDS = "clock_stands"
    ODOMETRY = "odometry"
    CAMERA_TURN = "camera_turn"


@dataclass(frozen=True, slots=True)
class StampedPose:
    """Where the robot believes it is, and since when.

    Attributes:
        silent_s: Wall time since its source said anything new; 0 for one that need not.
        is_clock_still: The robot's clock does not move on.
        is_odometry: It was taken from odometry, which drifts, for want of a pose on the map.
    """

    pose: Pose
    stamp_s: float
    silent_s: float = 0.0
    is_odometry: bool = False
    is_clock_still: bool = False

    def measure_age_s(self, now_s: float) -> float:
        """Return how old the estimate is, by robot time or, while that stands, by the wall."""
        return max(now_s - self.stamp_s, self.silent_s, 0.0)

    def find_doubt(self, now_s: float) -> PoseDoubt | None:
        """Return why the robot may be elsewhere; None for a fresh pose on the map."""
        if self.is_clock_still:
            return PoseDoubt.CLOCK_STANDS
        if self.silent_s > OLD_POSE_S:
            return PoseDoubt.SILENT_POSE
        if now_s - self.stamp_s > OLD_POSE_S:
            return PoseDoubt.OLD_POSE
        return PoseDoubt.ODOMETRY if self.is_odometry else None


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPicture:
    """One picture of a camera.

    Attributes:
        media_type: Such as "image/jpeg".
        horizontal_fov_rad: The angle between the left and the right edge; None where unknown.
        pose: Where the robot believed it stood, in the map frame, with the heading in which the
            camera looked.
        stamp_s: Robot time of the exposure.
        pose_doubt: Why it may have stood or looked elsewhere; None for a fresh pose on the map.
    """

    data: bytes
    media_type: str
    width_px: int
    height_px: int
    horizontal_fov_rad: float | None
    pose: Pose
    stamp_s: float
    pose_doubt: PoseDoubt | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """One thing that the robot's object detector reports in the current camera view.

    Attributes:
        bearing_rad: From the robot's heading, left positive.
        range_m: From the robot; None where the detector does not measure it.
    """

    label: str
    confidence_ratio: float
    bearing_rad: float
    range_m: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeScan:
    """One turn of the robot's laser, as from the middle of its base; compared by identity.

    Where on the robot the laser is mounted, and which side up, is worked in.

    Attributes:
        angles_rad: By beam, from the robot's heading, left positive; shape (n,), in any order.
        ranges_m: By beam, from the robot to what it met; infinite where it met nothing, NaN where
            it is not known what it met.
        reach_m: How far a beam that met nothing would have met something.
        pose: Where the robot believed it stood, in the map frame.
        stamp_s: Robot time of the measurement.
    """

    angles_rad: NDArray[np.float64]
    ranges_m: NDArray[np.float64]
    reach_m: float
    pose: Pose
    stamp_s: float

    def __post_init__(self) -> None:
        """Copy and lock the arrays."""
        for name in ("angles_rad", "ranges_m"):
            values = np.array(getattr(self, name), dtype=np.float64)
            values.setflags(write=False)
            object.__setattr__(self, name, values)


class NavigationPart(StrEnum):
    """What a robot's navigation tells of itself."""

    PLAN = "plan"
    FOOTPRINT = "footprint"
    GLOBAL_COSTMAP = "global_costmap"
    LOCAL_COSTMAP = "local_costmap"


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationLook:
    """What navigation told last of one part of itself.

    Attributes:
        age_s: By its stamp; None where nothing has come.
        lines: In the map frame: the planned path, the footprint as a ring, or rings around what a
            costmap closes to the middle of the robot.
        unplaced_frame: The frame it was told in, where that is not joined to the map's.
    """

    part: NavigationPart
    age_s: float | None
    lines: tuple[tuple[Point, ...], ...] = ()
    unplaced_frame: str = ""


class GoalState(StrEnum):
    """How a drive stands; planned ones wait their turn, timed-out ones came no nearer."""

    PLANNED = "planned"
    ACCEPTED = "accepted"
    DRIVING = "driving"
    ARRIVED = "arrived"
    BLOCKED = "blocked"
    CANCELLED = "cancelled"
    PREEMPTED = "preempted"
    REJECTED = "rejected"
    TIMED_OUT = "timed_out"
    LOST = "lost"

    @property
    def is_final(self) -> bool:
        """True when nothing more will happen."""
        return self not in (GoalState.PLANNED, GoalState.ACCEPTED, GoalState.DRIVING)


class CauseCode(StrEnum):
    """What ended a drive, or keeps it waiting.

    The first are words from outside the robot, then what is seen of it from outside, then what is
    closed, then what its own navigation does and says.
    """

    CANCELLED = "cancelled"
    STOPPED = "stopped"
    REPLACED = "replaced"
    REPLACED_BY_OTHERS = "replaced_by_others"
    CLIENT_GONE = "client_gone"
    CLIENT_SILENT = "client_silent"
    SERVER_ENDED = "server_ended"
    HELD = "held"
    REFUSED = "refused"
    WAITING = "waiting"
    PREVIOUS_ENDED = "previous_ended"
    POSE_JUMPED = "pose_jumped"
    POSE_UNKNOWN = "pose_unknown"
    ROBOT_SILENT = "robot_silent"
    CLOCK_STANDS = "clock_stands"
    NOT_BEGUN = "not_begun"
    NOT_MOVED = "not_moved"
    STOOD_STILL = "stood_still"
    GOAL_CLOSED = "goal_closed"
    GOAL_OFF_MAP = "goal_off_map"
    GOAL_OCCUPIED = "goal_occupied"
    NAVIGATION_AT_AREA = "navigation_at_area"
    NO_WAY_ROUND = "no_way_round"
    VELOCITY_AT_AREA = "velocity_at_area"
    OTHERS_AT_AREA = "others_at_area"
    NOT_SENT_ON = "not_sent_on"
    NOT_TAKEN = "not_taken"
    REJECTED = "rejected"
    NAVIGATION_LOST = "navigation_lost"
    NAVIGATION_MUTE = "navigation_mute"
    NAVIGATION_SAID = "navigation_said"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """Why a drive ended as it did, or why it waits.

    Attributes:
        code: What it was.
        after_s: How long something had lasted by then.
        distance_m: To the goal or area, or of the jump.
        name: Of the area, or of the kind of navigation.
        quote: What the robot's software or the operator said, or the error, word for word.
        previous: Why the drive before it ended.
    """

    code: CauseCode
    after_s: float | None = None
    distance_m: float | None = None
    name: str = ""
    quote: str = ""
    previous: "Cause | None" = None

    def __str__(self) -> str:
        """Return the code and its numbers, or the quotation where that is all; for logs."""
        if self.code in (CauseCode.NAVIGATION_SAID, CauseCode.REFUSED):
            return self.quote
        after = "" if self.after_s is None else f"{self.after_s:.1f} s"
        distance = "" if self.distance_m is None else f"{self.distance_m:.2f} m"
        previous = "" if self.previous is None else str(self.previous)
        details = ", ".join(filter(None, (self.name, distance, after, self.quote, previous)))
        return f"{self.code} ({details})" if details else str(self.code)


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalStatus:
    """How a drive stands now.

    Attributes:
        distance_left_m: Along the planned path; None where the robot does not say.
        n_recoveries: How often it had to try again.
        cause: Why it ended as it did, or waits; None while it drives, or if unknown.
        afterwards: What became of it after its end, where navigation took it up after all.
    """

    state: GoalState
    distance_left_m: float | None = None
    n_recoveries: int = 0
    cause: Cause | None = None
    afterwards: str = ""


class Robot(Protocol):
    """A robot with a map, a pose, perhaps a camera, and navigation.

    Methods raise `LinkError` when the robot cannot be reached or does not offer what was asked.
    """

    @property
    def description(self) -> RobotDescription:
        """What is fixed about this robot."""

    @property
    def now_s(self) -> float:
        """Robot time."""

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""

    async def fetch_map(self) -> OccupancyGrid:
        """Return the latest map."""

    async def fetch_pose(self) -> StampedPose:
        """Return where the robot believes it is."""

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        """Take a picture with the camera of that name; None for the one that looks ahead."""

    async def fetch_detections(self) -> tuple[Detection, ...]:
        """Return what the robot's own object detector reports in the camera view."""

    async def fetch_scan(self) -> RangeScan | None:
        """Return what the laser meets now; None without a laser, or where no scan comes in time.

        It is evidence on the side: it takes no longer than `SCAN_PATIENCE_S`, and no laser that is
        silent, late or turned on its side raises.
        """

    async def fetch_navigation(self) -> tuple[NavigationLook, ...]:
        """Return what navigation tells of path, footprint and costmaps; empty for nothing."""

    async def send_goal(self, goal: Pose) -> str:
        """Start a drive in the robot's navigation and return the id it is known by."""

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        """Return how a drive stands, also after it has ended."""

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Return how goals stand that others have sent and that are under way; empty when none."""

    async def cancel_goal(self, robot_goal_id: str) -> None:
        """Ask the navigation to end a drive; the robot stops."""

    async def stop(self) -> None:
        """End every drive and command zero velocity, at once."""
