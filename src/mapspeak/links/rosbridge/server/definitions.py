"""The message types the server knows, as their `.msg` files say; written for ROS 2.

`Interfaces` makes of them what ROS 1 says: `time` and `duration`, `seq` in the header, and the
capital letters of CameraInfo.
"""

__all__ = ["MESSAGES", "SERVICES"]

_GOAL_STATUS_CONSTANTS = """
uint8 PENDING=0
uint8 ACTIVE=1
uint8 PREEMPTED=2
uint8 SUCCEEDED=3
uint8 ABORTED=4
uint8 REJECTED=5
uint8 PREEMPTING=6
uint8 RECALLING=7
uint8 RECALLED=8
uint8 LOST=9
"""

_CANCEL_GOAL_CONSTANTS = """
int8 ERROR_NONE=0
int8 ERROR_REJECTED=1
int8 ERROR_UNKNOWN_GOAL_ID=2
int8 ERROR_GOAL_TERMINATED=3
"""

MESSAGES = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/Bool": "bool data",
    "std_msgs/Empty": "",
    "std_msgs/Float32": "float32 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/Int32": "int32 data",
    "std_msgs/String": "string data",
    "rosgraph_msgs/Clock": "builtin_interfaces/Time clock",
    "rosgraph_msgs/Log": (
        "byte DEBUG=1\nbyte INFO=2\nbyte WARN=4\nbyte ERROR=8\nbyte FATAL=16\n"
        "std_msgs/Header header\nbyte level\nstring name\nstring msg\nstring file\n"
        "string function\nuint32 line\nstring[] topics"
    ),
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/PoseWithCovarianceStamped": (
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/MapMetaData": (
        "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\n"
        "uint32 height\ngeometry_msgs/Pose origin"
    ),
    "nav_msgs/OccupancyGrid": "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data",
    "nav_msgs/Odometry": (
        "std_msgs/Header header\nstring child_frame_id\n"
        "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "sensor_msgs/RegionOfInterest": (
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify"
    ),
    "sensor_msgs/CameraInfo": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
        "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
        "uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi"
    ),
    "unique_identifier_msgs/UUID": "uint8[16] uuid",
    "action_msgs/GoalInfo": "unique_identifier_msgs/UUID goal_id\nbuiltin_interfaces/Time stamp",
    "action_msgs/GoalStatus": (
        "int8 STATUS_UNKNOWN=0\nint8 STATUS_ACCEPTED=1\nint8 STATUS_EXECUTING=2\n"
        "int8 STATUS_CANCELING=3\nint8 STATUS_SUCCEEDED=4\nint8 STATUS_CANCELED=5\n"
        "int8 STATUS_ABORTED=6\naction_msgs/GoalInfo goal_info\nint8 status"
    ),
    "action_msgs/GoalStatusArray": "action_msgs/GoalStatus[] status_list",
    "nav2_msgs/NavigateToPose_Goal": "geometry_msgs/PoseStamped pose\nstring behavior_tree",
    "nav2_msgs/NavigateToPose_Result": "uint16 error_code\nstring error_msg",
    "nav2_msgs/NavigateToPose_Feedback": (
        "geometry_msgs/PoseStamped current_pose\nbuiltin_interfaces/Duration navigation_time\n"
        "builtin_interfaces/Duration estimated_time_remaining\nint16 number_of_recoveries\n"
        "float32 distance_remaining"
    ),
    "nav2_msgs/NavigateToPose_FeedbackMessage": (
        "unique_identifier_msgs/UUID goal_id\nnav2_msgs/NavigateToPose_Feedback feedback"
    ),
    "rcl_interfaces/ParameterValue": (
        "uint8 type\nbool bool_value\nint64 integer_value\nfloat64 double_value\n"
        "string string_value\nbyte[] byte_array_value\nbool[] bool_array_value\n"
        "int64[] integer_array_value\nfloat64[] double_array_value\nstring[] string_array_value"
    ),
    "rcl_interfaces/Parameter": "string name\nrcl_interfaces/ParameterValue value",
    "rcl_interfaces/ParameterDescriptor": "string name\nuint8 type\nstring description",
    "rcl_interfaces/ListParametersResult": "string[] names\nstring[] prefixes",
    "rcl_interfaces/SetParametersResult": "bool successful\nstring reason",
    "actionlib_msgs/GoalID": "builtin_interfaces/Time stamp\nstring id",
    "actionlib_msgs/GoalStatus": (
        f"actionlib_msgs/GoalID goal_id\nuint8 status{_GOAL_STATUS_CONSTANTS}string text"
    ),
    "actionlib_msgs/GoalStatusArray": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus[] status_list"
    ),
    "move_base_msgs/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose",
    "move_base_msgs/MoveBaseFeedback": "geometry_msgs/PoseStamped base_position",
    "move_base_msgs/MoveBaseResult": "",
    "move_base_msgs/MoveBaseActionGoal": (
        "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\nmove_base_msgs/MoveBaseGoal goal"
    ),
    "move_base_msgs/MoveBaseActionFeedback": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n"
        "move_base_msgs/MoveBaseFeedback feedback"
    ),
    "move_base_msgs/MoveBaseActionResult": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n"
        "move_base_msgs/MoveBaseResult result"
    ),
}

SERVICES = {
    "rcl_interfaces/ListParameters": (
        "string[] prefixes\nuint64 depth",
        "rcl_interfaces/ListParametersResult result",
    ),
    "rcl_interfaces/GetParameters": ("string[] names", "rcl_interfaces/ParameterValue[] values"),
    "rcl_interfaces/GetParameterTypes": ("string[] names", "uint8[] types"),
    "rcl_interfaces/DescribeParameters": (
        "string[] names",
        "rcl_interfaces/ParameterDescriptor[] descriptors",
    ),
    "rcl_interfaces/SetParameters": (
        "rcl_interfaces/Parameter[] parameters",
        "rcl_interfaces/SetParametersResult[] results",
    ),
    "std_srvs/Empty": ("", ""),
    "nav_msgs/GetMap": ("", "nav_msgs/OccupancyGrid map"),
    "action_msgs/CancelGoal": (
        "action_msgs/GoalInfo goal_info",
        f"{_CANCEL_GOAL_CONSTANTS}int8 return_code\naction_msgs/GoalInfo[] goals_canceling",
    ),
}
"""Requests and responses of the services that are not rosapi's own."""
