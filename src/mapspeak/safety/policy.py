"""What a robot may be told to do, with the usual denials; `policyfile` reads it from a file."""

import fnmatch
import itertools
from collections.abc import Collection
from dataclasses import dataclass, field
from datetime import datetime, time, timedelta
from enum import StrEnum

from mapspeak.geometry import Point
from mapspeak.safety.commands import CommandKind

USUAL_DENIALS = {
    CommandKind.PUBLISH: (
        *("*/tf", "*/tf_static", "*/clock", "*/map", "*/map_updates", "*/odom", "*/odometry*"),
        *("*/scan", "*_scan", "*/scan_*", "*/initialpose", "*/speed_limit"),
        *("*/keepout*", "*/*filter_mask", "*/*filter_info"),
        *("*/robot_description", "*/parameter_events", "*/rosout"),
        *("*/goal_pose", "*/goal", "*/goal_update", "*/move_base_simple/*", "*/move_base/*"),
        "*/_action/*",
    ),
    CommandKind.CALL: (
        *("*set_param*", "*delete_param*", "*shutdown*", "*change_state*", "*manage_nodes*"),
        *("*load_node", "*unload_node", "*[!s]kill*", "*/_action/*", "*set_logger_*"),
        # Where the robot is, and on which map.
        *("*set_pose*", "*initial_pose*", "*global_localization*", "*set_datum", "*/datum"),
        *("*load_map*", "*set_map*", "*deserialize*", "*load_database*"),
        *("*toggle_filter*", "*keepout*", "*collision_monitor*"),
        # These drive the robot past the planner, the latter in a simulator.
        "*dock*",
        *("*set_model_*", "*set_entity_*", "*set_link_*", "*apply_*wrench*", "*apply_*effort*"),
        # These end or hang the rosapi of ROS 2, and with it all questions to the robot.
        *("*/message_details", "*/service_re*_details", "*/get_param_names"),
    ),
    CommandKind.ACT: (
        *("*navigate*", "*move_base*", "*exe_path*", "*recovery*", "*track_route*"),
        *("*follow_path*", "*follow_*waypoints*", "*follow_object*", "*wall_follow*"),
        *("*drive_on_heading*", "*drive_arc*", "*drive_distance*", "*rotate_angle*"),
        *("*backup*", "*spin*", "*dock*", "*assisted_teleop*"),
    ),
    CommandKind.SET_PARAMETER: (
        *("*vel*", "*speed*", "*accel*", "*decel*", "*acc_lim*"),
        # As MPPI and the graceful controller name their limits.
        *("*[./:][va][xy]_*", "*[./:][wa]z_*", "*v_linear*", "*v_angular*"),
        *("*footprint*", "*radius*", "*costmap*", "*keepout*", "*inflation*", "*collision*"),
        *("*allow_unknown*", "*track_unknown*"),
        # With these a robot loses itself: its frames, its clock, what it listens to, its place.
        *("*frame*", "*use_sim_time", "*topic*", "*initial_pose*", "*map_server*"),
        *("*publish_tf*", "*tf_broadcast*", "*tf_prefix*"),
    ),
    CommandKind.SKILL: (),
}
"""By what things are called."""

USUAL_TYPES = {
    CommandKind.PUBLISH: (
        *("tf2_msgs/TFMessage", "tf/tfMessage", "rosgraph_msgs/Clock", "nav_msgs/Odometry"),
        *("nav_msgs/OccupancyGrid", "map_msgs/*", "geometry_msgs/PoseWithCovarianceStamped"),
        *("sensor_msgs/LaserScan", "sensor_msgs/MultiEchoLaserScan", "sensor_msgs/PointCloud*"),
        *("sensor_msgs/Range", "nav2_msgs/SpeedLimit", "nav2_msgs/Costmap*"),
    ),
    CommandKind.CALL: (
        *("nav2_msgs/SetInitialPose", "nav2_msgs/LoadMap", "nav_msgs/LoadMap", "nav_msgs/SetMap"),
        *("nav2_msgs/Toggle", "nav2_msgs/ManageLifecycleNodes", "lifecycle_msgs/ChangeState"),
        *("slam_toolbox/DeserializePoseGraph", "robot_localization/Set*"),
        *("rcl_interfaces/SetParameters*", "dynamic_reconfigure/Reconfigure"),
        *("composition_interfaces/LoadNode", "composition_interfaces/UnloadNode"),
    ),
    CommandKind.ACT: (
        *("*/Navigate*", "*/MoveBase*", "*/ExePath", "*/Recovery", "*/ComputeAndTrackRoute"),
        *("*/FollowPath", "*/FollowWaypoints", "*/FollowGPSWaypoints", "*/FollowObject"),
        *("*/Spin", "*/BackUp", "*/DriveOnHeading", "*/AssistedTeleop", "*/Dock*", "*/Undock*"),
        *("*/DriveArc", "*/DriveDistance", "*/RotateAngle", "*/WallFollow"),
    ),
    CommandKind.SET_PARAMETER: (),
    CommandKind.SKILL: (),
}
"""By what the robot says they are, whatever they are called."""


DAYS = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")


@dataclass(frozen=True, slots=True, kw_only=True)
class Speeds:
    """The fastest that may be published.

    Attributes:
        linear_mps: The length of the linear part.
        angular_radps: The length of the angular part.
    """

    linear_mps: float = 0.5
    angular_radps: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hours:
    """A time of day, by the operator's wall clock; over midnight where it ends before it begins.

    Attributes:
        ends: The first moment after; midnight for the end of the day.
        days: On which it begins, 0 for Monday.
    """

    begins: time = time(0, 0)
    ends: time = time(0, 0)
    days: frozenset[int] = frozenset(range(7))

    def end_of(self, at: datetime) -> datetime | None:
        """Return when the time ends that a moment lies in; None where it lies in none."""
        for n_days_ago in (0, 1):
            day = at - timedelta(days=n_days_ago)
            begins = datetime.combine(day.date(), self.begins, at.tzinfo)
            ends = datetime.combine(day.date(), self.ends, at.tzinfo)
            ends = ends if ends > begins else ends + timedelta(days=1)
            if day.weekday() in self.days and begins <= at < ends:
                return ends
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaRule:
    """A part of the floor that is closed: always, or at some hours.

    Attributes:
        outline: Its corners in order; empty where it is a region.
        further_outlines: Of other parts and of holes, as a mask has them.
        region_id: Of the room or corridor that it is, such as "C1"; empty where it has an outline.
        hours: When it is closed; None for always.
        reason: Why, in the operator's words; may be empty.
    """

    name: str
    outline: tuple[Point, ...] = ()
    further_outlines: tuple[tuple[Point, ...], ...] = ()
    region_id: str = ""
    hours: Hours | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Denial:
    """What in a policy is against a name.

    Attributes:
        key: Of the rule, below that of the kind of command.
    """

    key: str
    patterns: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Patterns:
    """Names that are allowed and denied, with * and ?; a denied name is never allowed.

    Attributes:
        allow: What may be used; a name without * and ? is free of the usual denials.
        deny: What may not, though it is allowed.
        usual: Likewise, unless it is allowed by its own name.
        usual_types: Likewise, by its type, as "package/Type".
    """

    allow: tuple[str, ...] = ("*",)
    deny: tuple[str, ...] = ()
    usual: tuple[str, ...] = ()
    usual_types: tuple[str, ...] = ()

    def find_denial(self, name: str, types: Collection[str] = ()) -> Denial | None:
        """Return what is against a name, or against one of its types; None when it may be used."""
        full = _full(name)
        known = [_full(each) for each in types]
        for pattern in self.deny:
            if any(_fits(each, pattern) for each in (full, *known)):
                return Denial(key="deny", patterns=(pattern,))
        if full not in map(_full, self.allow):
            by_name = (pattern for pattern in self.usual if _fits(full, pattern))
            by_type = (
                pattern
                for pattern in self.usual_types
                if any(_fits(each, pattern) for each in known)
            )
            found = next(itertools.chain(by_name, by_type), None)
            if found is not None:
                return Denial(key="usual_denials", patterns=(found,))
        if any(_fits(full, pattern) for pattern in self.allow):
            return None
        return Denial(key="allow", patterns=self.allow)


class Otherwise(StrEnum):
    """What becomes of a command that needs approval when no person can be asked."""

    REFUSE = "refuse"
    QUEUE = "queue"


class WhenBusy(StrEnum):
    """What becomes of a drive that is asked for while another one is under way."""

    REPLACE = "replace"
    WAIT = "wait"
    REFUSE = "refuse"


@dataclass(frozen=True, slots=True, kw_only=True)
class Approval:
    """What a person must agree to.

    Attributes:
        otherwise: What becomes of them where the client cannot ask.
    """

    kinds: frozenset[CommandKind] = frozenset()
    otherwise: Otherwise = Otherwise.REFUSE


USUAL_RATES = {
    CommandKind.DRIVE: 60,
    CommandKind.PUBLISH: 1200,
    CommandKind.CALL: 120,
    CommandKind.ACT: 60,
    CommandKind.SET_PARAMETER: 30,
    CommandKind.SKILL: 120,
}
RATE_KEYS = {
    CommandKind.DRIVE: "drives_per_minute",
    CommandKind.PUBLISH: "publishes_per_minute",
    CommandKind.CALL: "calls_per_minute",
    CommandKind.ACT: "actions_per_minute",
    CommandKind.SET_PARAMETER: "parameters_per_minute",
    CommandKind.SKILL: "skills_per_minute",
}
"""What policy.yaml calls them."""


def _usual_patterns() -> dict[CommandKind, Patterns]:
    return {
        kind: Patterns(usual=usual, usual_types=USUAL_TYPES[kind])
        for kind, usual in USUAL_DENIALS.items()
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """Everything that commands are held to; its defaults are on without a file.

    Attributes:
        is_read_only: Nothing moves and nothing changes; stopping stays.
        latches_on_stop: After a client's stop only a person releases the robot.
        when_busy: What becomes of a drive while another one is under way.
        needs_known_way: Goals only where a known way leads.
        clearance_m: What the robot's edge keeps from obstacles, at goals and on ways.
        farthest_m: The longest way to a goal.
        patterns: For the names of topics, services, actions and parameters.
        rates: Commands of each kind in any minute of robot time.
    """

    is_read_only: bool = False
    latches_on_stop: bool = False
    when_busy: WhenBusy = WhenBusy.REPLACE
    speeds: Speeds = Speeds()
    needs_known_way: bool = True
    clearance_m: float = 0.0
    farthest_m: float = 500.0
    areas: tuple[AreaRule, ...] = ()
    patterns: dict[CommandKind, Patterns] = field(default_factory=_usual_patterns)
    approval: Approval = Approval()
    rates: dict[CommandKind, int] = field(default_factory=lambda: dict(USUAL_RATES))


def _full(name: str) -> str:
    return "/" + name.strip().strip("/")


def _fits(name: str, pattern: str) -> bool:
    wanted = pattern if pattern.startswith(("/", "*")) else f"/{pattern}"
    return fnmatch.fnmatchcase(name.casefold(), wanted.casefold())
