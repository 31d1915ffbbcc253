"""Actions: goals and their states in ROS 1 and ROS 2, and the actions of navigation."""

__all__ = ["ACTIONS"]

ACTIONS = """
MSG: unique_identifier_msgs/UUID
uint8[16] uuid

MSG: action_msgs/GoalInfo
unique_identifier_msgs/UUID goal_id
builtin_interfaces/Time stamp

MSG: action_msgs/GoalStatus
int8 STATUS_UNKNOWN=0
int8 STATUS_ACCEPTED=1
int8 STATUS_EXECUTING=2
int8 STATUS_CANCELING=3
int8 STATUS_SUCCEEDED=4
int8 STATUS_CANCELED=5
int8 STATUS_ABORTED=6
action_msgs/GoalInfo goal_info
int8 status

MSG: action_msgs/GoalStatusArray
action_msgs/GoalStatus[] status_list

SRV: action_msgs/CancelGoal
action_msgs/GoalInfo goal_info
---
int8 ERROR_NONE=0
int8 ERROR_REJECTED=1
int8 ERROR_UNKNOWN_GOAL_ID=2
int8 ERROR_GOAL_TERMINATED=3
int8 return_code
action_msgs/GoalInfo[] goals_canceling

MSG: actionlib_msgs/GoalID
builtin_interfaces/Time stamp
string id

MSG: actionlib_msgs/GoalStatus
actionlib_msgs/GoalID goal_id
uint8 status
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
string text

MSG: actionlib_msgs/GoalStatusArray
std_msgs/Header header
actionlib_msgs/GoalStatus[] status_list

MSG: move_base_msgs/MoveBaseGoal
geometry_msgs/PoseStamped target_pose

MSG: move_base_msgs/MoveBaseResult

MSG: move_base_msgs/MoveBaseFeedback
geometry_msgs/PoseStamped base_position

MSG: move_base_msgs/MoveBaseActionGoal
std_msgs/Header header
actionlib_msgs/GoalID goal_id
move_base_msgs/MoveBaseGoal goal

MSG: move_base_msgs/MoveBaseActionResult
std_msgs/Header header
actionlib_msgs/GoalStatus status
move_base_msgs/MoveBaseResult result

MSG: move_base_msgs/MoveBaseActionFeedback
std_msgs/Header header
actionlib_msgs/GoalStatus status
move_base_msgs/MoveBaseFeedback feedback

ACTION: nav2_msgs/NavigateToPose
geometry_msgs/PoseStamped pose
string behavior_tree
---
uint16 error_code
string error_msg
---
geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining

ACTION: nav2_msgs/NavigateThroughPoses
geometry_msgs/PoseStamped[] poses
string behavior_tree
---
uint16 error_code
string error_msg
---
geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining
int16 number_of_poses_remaining

ACTION: nav2_msgs/ComputePathToPose
geometry_msgs/PoseStamped goal
geometry_msgs/PoseStamped start
string planner_id
bool use_start
---
nav_msgs/Path path
builtin_interfaces/Duration planning_time
uint16 error_code
string error_msg
---

ACTION: nav2_msgs/FollowWaypoints
uint32 number_of_loops
uint32 goal_index 0
geometry_msgs/PoseStamped[] poses
---
int32[] missed_waypoints
int16 error_code
string error_msg
---
uint32 current_waypoint

ACTION: nav2_msgs/Spin
float32 target_yaw
builtin_interfaces/Duration time_allowance
---
builtin_interfaces/Duration total_elapsed_time
uint16 error_code
string error_msg
---
float32 angular_distance_traveled

ACTION: nav2_msgs/BackUp
geometry_msgs/Point target
float32 speed
builtin_interfaces/Duration time_allowance
---
builtin_interfaces/Duration total_elapsed_time
uint16 error_code
string error_msg
---
float32 distance_traveled

ACTION: nav2_msgs/DriveOnHeading
geometry_msgs/Point target
float32 speed
builtin_interfaces/Duration time_allowance
---
builtin_interfaces/Duration total_elapsed_time
uint16 error_code
string error_msg
---
float32 distance_traveled

ACTION: nav2_msgs/Wait
builtin_interfaces/Duration time
---
builtin_interfaces/Duration total_elapsed_time
uint16 error_code
string error_msg
---
builtin_interfaces/Duration time_left

ACTION: example_interfaces/Fibonacci
int32 order
---
int32[] sequence
---
int32[] sequence

SRV: example_interfaces/AddTwoInts
int64 a
int64 b
---
int64 sum

ACTION: turtlesim/RotateAbsolute
float32 theta
---
float32 delta
---
float32 remaining
"""
