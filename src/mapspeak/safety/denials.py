"""The usual denials: names and types of what would go around a policy, or around safety itself."""

from mapspeak.safety.commands import Kind

USUAL_DENIALS = {
    Kind.PUBLISH: (
        *("*/tf", "*/tf_static", "*/clock", "*/map", "*/map_updates", "*/odom", "*/odometry*"),
        *("*/scan", "*_scan", "*/scan_*", "*/initialpose", "*/speed_limit"),
        *("*/keepout*", "*/*filter_mask", "*/*filter_info"),
        *("*/robot_description", "*/parameter_events", "*/rosout"),
        *("*/goal_pose", "*/goal", "*/goal_update", "*/move_base_simple/*", "*/move_base/*"),
        "*/_action/*",
    ),
    Kind.CALL: (
        *("*set_param*", "*delete_param*", "*shutdown*", "*change_state*", "*manage_nodes*"),
        *("*load_node", "*unload_node", "*kill*", "*/_action/*", "*set_logger_*"),
        # Where the robot is, and on which map.
        *("*set_pose*", "*initial_pose*", "*global_localization*", "*set_datum", "*/datum"),
        *("*load_map*", "*set_map*", "*deserialize*", "*load_database*"),
        *("*toggle_filter*", "*keepout*", "*collision_monitor*"),
        # In a simulator these move the robot itself.
        *("*set_model_*", "*set_entity_*", "*set_link_*", "*apply_*wrench*", "*apply_*effort*"),
        # These end or hang the rosapi of ROS 2, and with it all questions to the robot.
        *("*/message_details", "*/service_re*_details", "*/get_param_names"),
    ),
    Kind.ACT: (
        *("*navigate*", "*move_base*", "*exe_path*", "*recovery*", "*track_route*"),
        *("*follow_path*", "*follow_*waypoints*", "*follow_object*", "*wall_follow*"),
        *("*drive_on_heading*", "*drive_arc*", "*drive_distance*", "*rotate_angle*"),
        *("*backup*", "*spin*", "*dock*", "*assisted_teleop*"),
    ),
    Kind.SET_PARAMETER: (
        *("*vel*", "*speed*", "*accel*", "*decel*", "*acc_lim*"),
        # As MPPI and the graceful controller name their limits.
        *("*[./:][va][xy]_*", "*[./:][wa]z_*", "*v_linear*", "*v_angular*"),
        *("*footprint*", "*radius*", "*costmap*", "*keepout*", "*inflation*", "*collision*"),
        *("*allow_unknown*", "*track_unknown*"),
        # With these a robot loses itself: its frames, its clock, what it listens to, its place.
        *("*frame*", "*use_sim_time", "*topic*", "*initial_pose*", "*map_server*"),
        *("*publish_tf*", "*tf_broadcast*", "*tf_prefix*"),
    ),
}
"""By what things are called."""

USUAL_TYPES = {
    Kind.PUBLISH: (
        *("tf2_msgs/TFMessage", "tf/tfMessage", "rosgraph_msgs/Clock", "nav_msgs/Odometry"),
        *("nav_msgs/OccupancyGrid", "map_msgs/*", "geometry_msgs/PoseWithCovarianceStamped"),
        *("sensor_msgs/LaserScan", "sensor_msgs/MultiEchoLaserScan", "sensor_msgs/PointCloud*"),
        *("sensor_msgs/Range", "nav2_msgs/SpeedLimit", "nav2_msgs/Costmap*"),
    ),
    Kind.CALL: (
        *("nav2_msgs/SetInitialPose", "nav2_msgs/LoadMap", "nav_msgs/LoadMap", "nav_msgs/SetMap"),
        *("nav2_msgs/Toggle", "nav2_msgs/ManageLifecycleNodes", "lifecycle_msgs/ChangeState"),
        *("slam_toolbox/DeserializePoseGraph", "robot_localization/Set*"),
        *("rcl_interfaces/SetParameters*", "dynamic_reconfigure/Reconfigure"),
        *("composition_interfaces/LoadNode", "composition_interfaces/UnloadNode"),
    ),
    Kind.ACT: (
        *("*/Navigate*", "*/MoveBase*", "*/ExePath", "*/Recovery", "*/ComputeAndTrackRoute"),
        *("*/FollowPath", "*/FollowWaypoints", "*/FollowGPSWaypoints", "*/FollowObject"),
        *("*/Spin", "*/BackUp", "*/DriveOnHeading", "*/AssistedTeleop", "*/Dock*", "*/Undock*"),
        *("*/DriveArc", "*/DriveDistance", "*/RotateAngle", "*/WallFollow"),
    ),
    Kind.SET_PARAMETER: (),
}
"""By what the robot says they are, whatever they are called."""
