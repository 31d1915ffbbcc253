"""Maps, paths, plans and odometry; map servers, SLAM and velocities of cars."""

__all__ = ["NAVIGATION"]

NAVIGATION = """
MSG: nav_msgs/MapMetaData
builtin_interfaces/Time map_load_time
float32 resolution
uint32 width
uint32 height
geometry_msgs/Pose origin

MSG: nav_msgs/OccupancyGrid
std_msgs/Header header
nav_msgs/MapMetaData info
int8[] data

MSG: nav_msgs/GridCells
std_msgs/Header header
float32 cell_width
float32 cell_height
geometry_msgs/Point[] cells

MSG: nav_msgs/Odometry
std_msgs/Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist

MSG: nav_msgs/Path
std_msgs/Header header
geometry_msgs/PoseStamped[] poses

SRV: nav_msgs/GetMap
---
nav_msgs/OccupancyGrid map

SRV: nav_msgs/GetPlan
geometry_msgs/PoseStamped start
geometry_msgs/PoseStamped goal
float32 tolerance
---
nav_msgs/Path plan

SRV: nav_msgs/LoadMap
string map_url
---
uint8 RESULT_SUCCESS=0
uint8 RESULT_MAP_DOES_NOT_EXIST=1
uint8 RESULT_INVALID_MAP_DATA=2
uint8 RESULT_INVALID_MAP_METADATA=3
uint8 RESULT_UNDEFINED_FAILURE=255
nav_msgs/OccupancyGrid map
uint8 result

SRV: nav_msgs/SetMap
nav_msgs/OccupancyGrid map
geometry_msgs/PoseWithCovarianceStamped initial_pose
---
bool success

MSG: map_msgs/OccupancyGridUpdate
std_msgs/Header header
int32 x
int32 y
uint32 width
uint32 height
int8[] data

SRV: nav2_msgs/LoadMap
string map_url
---
uint8 RESULT_SUCCESS=0
uint8 RESULT_MAP_DOES_NOT_EXIST=1
uint8 RESULT_INVALID_MAP_DATA=2
uint8 RESULT_INVALID_MAP_METADATA=3
uint8 RESULT_UNDEFINED_FAILURE=255
nav_msgs/OccupancyGrid map
uint8 result

SRV: nav2_msgs/SaveMap
string map_topic
string map_url
string image_format
string map_mode
float32 free_thresh
float32 occupied_thresh
---
bool result

SRV: nav2_msgs/ClearEntireCostmap
std_msgs/Empty request
---
std_msgs/Empty response

SRV: nav2_msgs/ManageLifecycleNodes
uint8 STARTUP=0
uint8 PAUSE=1
uint8 RESUME=2
uint8 RESET=3
uint8 SHUTDOWN=4
uint8 command
---
bool success

SRV: slam_toolbox/SaveMap
std_msgs/String name
---
uint8 RESULT_SUCCESS=0
uint8 RESULT_NO_MAP_RECEIEVD=1
uint8 RESULT_UNDEFINED_FAILURE=255
uint8 result

SRV: slam_toolbox/SerializePoseGraph
string filename
---
uint8 RESULT_SUCCESS=0
uint8 RESULT_FAILED_TO_WRITE_FILE=255
uint8 result

SRV: slam_toolbox/Pause
---
bool status

MSG: ackermann_msgs/AckermannDrive
float32 steering_angle
float32 steering_angle_velocity
float32 speed
float32 acceleration
float32 jerk

MSG: ackermann_msgs/AckermannDriveStamped
std_msgs/Header header
ackermann_msgs/AckermannDrive drive

MSG: turtlesim/Pose
float32 x
float32 y
float32 theta
float32 linear_velocity
float32 angular_velocity

MSG: turtlesim/Color
uint8 r
uint8 g
uint8 b

SRV: turtlesim/Spawn
float32 x
float32 y
float32 theta
string name
---
string name

SRV: turtlesim/Kill
string name
---

SRV: turtlesim/SetPen
uint8 r
uint8 g
uint8 b
uint8 width
uint8 off
---

SRV: turtlesim/TeleportAbsolute
float32 x
float32 y
float32 theta
---

SRV: turtlesim/TeleportRelative
float32 linear
float32 angular
---
"""
