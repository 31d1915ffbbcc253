"""A robot's ROS in good order, of which all names and figures are drawn."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from mapspeak.evaluation.inspected.playing import (
    InspectedSystem,
    OfferedService,
    Stream,
)
from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import Dialect, Message
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import FrameTransform
from mapspeak.spatial import OccupancyGrid

SCAN, IMU, ODOMETRY = "sensor_msgs/LaserScan", "sensor_msgs/Imu", "nav_msgs/Odometry"
SONAR, BATTERY, JOINTS = "sensor_msgs/Range", "sensor_msgs/BatteryState", "sensor_msgs/JointState"
GRID, TWIST, TRANSFORMS = "nav_msgs/OccupancyGrid", "geometry_msgs/Twist", "tf2_msgs/TFMessage"
PATH, JOY = "nav_msgs/Path", "sensor_msgs/Joy"
FIRST_S, LAST_S = 1_700_000_000, 1_760_000_000
"""Robots that run by the time of day have such clocks."""
LOCAL_CELLS = 60
SLOWEST_HZ, FASTER = 3.0, 8.0
"""Of laser scanners, and how many times as fast the fastest is."""
N_BEAMS = 90
PLAIN_KINDS = ("float32", "float64", "int16", "int32", "uint8", "bool", "string")
MEASURED = (
    "height", "force", "load", "current", "angle", "speed", "heat", "pressure", "offset", "torque",
)  # fmt: skip


def _one_of(*choices: str) -> Any:  # noqa: ANN401 - as dataclasses.field
    return field(metadata={"choices": choices})


@dataclass(frozen=True, slots=True, kw_only=True)
class Names:
    """What the parts of one robot's ROS are called: nodes, topics, frames, and a type of its own.

    `motors` drives the wheels and publishes the odometry, `smoother` hands velocities on to it,
    `locator` finds the robot's place on the map, and `watcher` looks after sensors and battery.
    `velocity` is the topic that the motors subscribe to, `planned` that of the navigation's
    velocities. `device` is what the robot carries; it publishes `status`, of `device_type`.
    """

    laser: str = _one_of(
        "/rplidar_node", "/sick_tim", "/hokuyo_node", "/ydlidar_driver", "/urg_node"
    )
    motors: str = _one_of(
        "/kobuki_node", "/wheel_driver", "/husky_base", "/chassis", "/motor_bridge"
    )
    imu: str = _one_of("/imu_driver", "/bno055", "/xsens_driver", "/phidgets_imu")
    sonar: str = _one_of("/sonar_node", "/ultrasound_driver", "/range_board")
    battery: str = _one_of("/battery_monitor", "/bms", "/power_board")
    joints: str = _one_of("/arm_driver", "/joint_publisher", "/gripper_driver")
    map_server: str = _one_of("/map_server", "/map_keeper", "/floor_plan")
    locator: str = _one_of("/amcl", "/localizer", "/cartographer_node", "/slam_toolbox")
    navigator: str = _one_of("/controller_server", "/local_planner", "/path_follower", "/pilot")
    smoother: str = _one_of(
        "/velocity_smoother", "/twist_mux", "/collision_monitor", "/speed_limiter"
    )
    joystick: str = _one_of("/teleop_node", "/gamepad", "/joy_teleop", "/remote_control")
    describer: str = _one_of("/robot_state_publisher")
    watcher: str = _one_of("/health_monitor", "/watchdog", "/diagnostics_collector")
    device: str = _one_of("/lift_node", "/docking_agent", "/conveyor_node", "/tray_node")
    scan: str = _one_of("/scan", "/front_scan", "/lidar/scan", "/base_scan")
    imu_data: str = _one_of("/imu/data", "/imu", "/imu/raw")
    range: str = _one_of("/sonar", "/range/front", "/ultrasound")
    charge: str = _one_of("/battery_state", "/battery", "/power/battery")
    joint_states: str = _one_of("/joint_states", "/arm/joint_states")
    map: str = _one_of("/map", "/floor_map", "/building/map", "/static_map")
    velocity: str = _one_of("/cmd_vel", "/base/cmd_vel", "/mobile_base/velocity")
    planned: str = _one_of("/nav_vel", "/cmd_vel_raw", "/planner/cmd_vel")
    status: str = _one_of("/device/status", "/load/state", "/payload")
    device_type: str = _one_of(
        "lift_msgs/LiftStatus", "tray_msgs/TrayState", "dock_msgs/DockReport"
    )
    base_frame: str = _one_of("base_footprint", "base_link", "chassis_link")
    laser_frame: str = _one_of("laser", "laser_link", "lidar_frame")


def draw_names(random: np.random.Generator) -> Names:
    """Draw what everything is called."""
    return Names(**{each.name: _one(random, each.metadata["choices"]) for each in fields(Names)})


def draw_system(
    random: np.random.Generator, names: Names, grid: OccupancyGrid, *, dialect: Dialect
) -> InspectedSystem:
    """Draw a system in which everything is as it should be."""
    bare = InspectedSystem(
        dialect=dialect,
        started_s=float(random.integers(FIRST_S, LAST_S)),
        streams=(*_sensors(random, names), *_maps(names, grid, dialect), *_motion(names)),
        subscriptions=_subscriptions(names),
        services=_services(random, names),
        types={names.device_type: _draw_type(random)},
    )
    parameters: dict[str, dict[str, Any]] = {node: {} for node in bare.nodes}
    parameters[names.navigator] = _navigation(random)
    parameters[names.laser] = {"frame_id": names.laser_frame, "angle_compensate": True}
    return replace(bare, parameters=parameters)


def _sensors(random: np.random.Generator, names: Names) -> tuple[Stream, ...]:
    # Evenly on a logarithmic scale, so that no one figure is near to most of them.
    laser_hz = round(2 * SLOWEST_HZ * FASTER ** random.random()) / 2
    walls_m = round(float(random.uniform(1.0, 6.0)), 2)
    charge = round(float(random.uniform(0.06, 0.96)), 2)
    range_m = round(float(random.uniform(0.3, 3.0)), 2)
    upright = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    place = {"x": 1.5, "y": 0.7, "z": 0.0}
    scan = {
        "angle_min": -3.14,
        "angle_max": 3.14,
        "angle_increment": 6.28 / (N_BEAMS - 1),
        "range_min": 0.05,
        "range_max": 12.0,
        "ranges": [walls_m] * N_BEAMS,
    }
    odometry = {
        "child_frame_id": names.base_frame,
        "pose": {"pose": {"position": place, "orientation": upright}},
    }
    imu = {"orientation": upright, "linear_acceleration": {"x": 0.0, "y": 0.0, "z": 9.81}}
    sonar = {"field_of_view": 0.5, "min_range": 0.05, "max_range": 4.0, "range": range_m}
    battery = {
        "voltage": round(22.0 + 4.0 * charge, 2),
        "current": -1.8,
        "percentage": charge,
        "capacity": 10.0,
        "design_capacity": 10.0,
        "present": True,
        "power_supply_status": 2,
        "power_supply_health": 1,
    }
    joints = {"name": ["shoulder", "elbow"], "position": [0.1, -0.4]}
    return _streams(
        (names.laser, names.scan, SCAN, scan, names.laser_frame, laser_hz),
        (names.motors, "/odom", ODOMETRY, odometry, "odom", 10.0),
        (names.imu, names.imu_data, IMU, imu, "imu_link", 20.0),
        (names.sonar, names.range, SONAR, sonar, "sonar_link", 5.0),
        (names.battery, names.charge, BATTERY, battery, names.base_frame, 2.0),
        (names.joints, names.joint_states, JOINTS, joints, "", 10.0),
        (names.device, names.status, names.device_type, {}, None, 2.0),
    )


def _streams(
    *rows: tuple[str, str, str, Message, str | None, float | None],
) -> tuple[Stream, ...]:
    """Return streams, each from its node, topic, type, values, frame and rate."""
    return tuple(
        Stream(node=node, topic=topic, type=kind, values=values, frame_id=frame, rate_hz=rate_hz)
        for node, topic, kind, values, frame, rate_hz in rows
    )


def _maps(names: Names, grid: OccupancyGrid, dialect: Dialect) -> tuple[Stream, ...]:
    cells = np.zeros((LOCAL_CELLS, LOCAL_CELLS), dtype=np.int8)
    around = OccupancyGrid(cells=cells, resolution_m=0.05)
    local = f"{names.navigator}/local_costmap"
    return _streams(
        (names.map_server, names.map, GRID, write_grid(grid, dialect=dialect), None, None),
        (names.navigator, local, GRID, write_grid(around, dialect=dialect), None, 2.0),
    )


def _motion(names: Names) -> tuple[Stream, ...]:
    place = (_transform("map", "odom", Pose(0.4, -0.2, 0.1)),)
    wheels = (_transform("odom", names.base_frame, Pose(1.5, 0.7, 0.4)),)
    fixed = (
        _transform(names.base_frame, "body", Pose(0.0, 0.0)),
        _transform("body", names.laser_frame, Pose(0.2, 0.0)),
    )
    tf = tuple(
        Stream(node=node, topic=topic, type=TRANSFORMS, transforms=transforms, rate_hz=rate_hz)
        for node, topic, transforms, rate_hz in (
            (names.locator, "/tf", place, 10.0),
            (names.motors, "/tf", wheels, 20.0),
            (names.describer, "/tf_static", fixed, None),
        )
    )
    commands = _streams(
        (names.navigator, names.planned, TWIST, {}, None, 10.0),
        (names.smoother, names.velocity, TWIST, {}, None, 10.0),
        (names.joystick, "/joy", JOY, {"axes": [0.0, 0.0]}, "", 5.0),
        (names.navigator, "/plan", PATH, {}, "map", 1.0),
    )
    return (*tf, *commands)


def _transform(parent: str, child: str, pose: Pose) -> FrameTransform:
    return FrameTransform(parent_from_child=pose, parent=parent, child=child, stamp_s=0.0)


def _subscriptions(names: Names) -> dict[str, dict[str, str]]:
    return {
        names.locator: {names.map: GRID, names.scan: SCAN, "/tf_static": TRANSFORMS},
        names.navigator: {
            names.map: GRID, names.scan: SCAN, "/odom": ODOMETRY, "/tf": TRANSFORMS,
        },
        names.smoother: {names.planned: TWIST, "/joy": JOY},
        names.motors: {names.velocity: TWIST},
        names.describer: {names.joint_states: JOINTS},
        names.watcher: {
            names.imu_data: IMU, names.range: SONAR, names.charge: BATTERY,
            names.status: names.device_type, "/plan": PATH,
            f"{names.navigator}/local_costmap": GRID,
        },
    }  # fmt: skip


def _services(random: np.random.Generator, names: Names) -> tuple[OfferedService, ...]:
    """Draw the names and the types: what a service does says neither."""
    simple = ("std_srvs/Trigger", "std_srvs/Empty")
    offered = (
        (names.motors, ("reset_odometry", "zero_odometry", "odometry/reset"), simple),
        (names.motors, ("motors/enable", "switch_motors"), ("std_srvs/SetBool", *simple)),
        (names.navigator, ("clear_costmap", "costmap/clear"), simple),
        (names.map_server, ("save_map", "map/save"), simple),
        (names.imu, ("calibrate_imu", "imu/calibrate"), simple),
    )
    return tuple(
        OfferedService(node=node, service=f"{node}/{_one(random, last)}", type=_one(random, types))
        for node, last, types in offered
    )


def _navigation(random: np.random.Generator) -> dict[str, Any]:
    return {
        "max_speed": round(float(random.uniform(0.3, 1.2)), 2),
        "max_turn_rate": round(float(random.uniform(0.5, 2.0)), 2),
        "inflation_radius": round(float(random.uniform(0.3, 0.8)), 2),
        "robot_radius": round(float(random.uniform(0.15, 0.35)), 2),
        "goal_tolerance": round(float(random.uniform(0.05, 0.4)), 2),
        "controller_frequency": float(random.integers(5, 31)),
        "obstacle_range": round(float(random.uniform(1.5, 5.0)), 1),
        "transform_tolerance": round(float(random.uniform(0.1, 0.9)), 1),
        "global_frame": "map",
    }


def _draw_type(random: np.random.Generator) -> str:
    """Draw the text of a message type: five fields, of which two are of one kind."""
    fields_drawn = [MEASURED[at] for at in random.permutation(len(MEASURED))[:5].tolist()]
    kinds = [PLAIN_KINDS[at] for at in random.permutation(len(PLAIN_KINDS))[:4].tolist()]
    return "\n".join(
        f"{kind} {name}" for kind, name in zip((*kinds, kinds[0]), fields_drawn, strict=True)
    )


def _one(random: np.random.Generator, choices: Sequence[str]) -> str:
    return choices[int(random.integers(len(choices)))]
