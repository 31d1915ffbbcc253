"""Points, poses, velocities, transforms, and marks for a viewer."""

__all__ = ["GEOMETRY"]

GEOMETRY = """
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z

MSG: geometry_msgs/Point32
float32 x
float32 y
float32 z

MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z

MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1

MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation

MSG: geometry_msgs/Pose2D
float64 x
float64 y
float64 theta

MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation

MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular

MSG: geometry_msgs/Accel
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular

MSG: geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque

MSG: geometry_msgs/Inertia
float64 m
geometry_msgs/Vector3 com
float64 ixx
float64 ixy
float64 ixz
float64 iyy
float64 iyz
float64 izz

MSG: geometry_msgs/Polygon
geometry_msgs/Point32[] points

MSG: geometry_msgs/PointStamped
std_msgs/Header header
geometry_msgs/Point point

MSG: geometry_msgs/Vector3Stamped
std_msgs/Header header
geometry_msgs/Vector3 vector

MSG: geometry_msgs/QuaternionStamped
std_msgs/Header header
geometry_msgs/Quaternion quaternion

MSG: geometry_msgs/PoseStamped
std_msgs/Header header
geometry_msgs/Pose pose

MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform

MSG: geometry_msgs/TwistStamped
std_msgs/Header header
geometry_msgs/Twist twist

MSG: geometry_msgs/AccelStamped
std_msgs/Header header
geometry_msgs/Accel accel

MSG: geometry_msgs/WrenchStamped
std_msgs/Header header
geometry_msgs/Wrench wrench

MSG: geometry_msgs/InertiaStamped
std_msgs/Header header
geometry_msgs/Inertia inertia

MSG: geometry_msgs/PolygonStamped
std_msgs/Header header
geometry_msgs/Polygon polygon

MSG: geometry_msgs/PoseArray
std_msgs/Header header
geometry_msgs/Pose[] poses

MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance

MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance

MSG: geometry_msgs/AccelWithCovariance
geometry_msgs/Accel accel
float64[36] covariance

MSG: geometry_msgs/PoseWithCovarianceStamped
std_msgs/Header header
geometry_msgs/PoseWithCovariance pose

MSG: geometry_msgs/TwistWithCovarianceStamped
std_msgs/Header header
geometry_msgs/TwistWithCovariance twist

MSG: geometry_msgs/AccelWithCovarianceStamped
std_msgs/Header header
geometry_msgs/AccelWithCovariance accel

MSG: tf2_msgs/TFMessage
geometry_msgs/TransformStamped[] transforms

MSG: tf2_msgs/TF2Error
uint8 NO_ERROR=0
uint8 LOOKUP_ERROR=1
uint8 CONNECTIVITY_ERROR=2
uint8 EXTRAPOLATION_ERROR=3
uint8 INVALID_ARGUMENT_ERROR=4
uint8 TIMEOUT_ERROR=5
uint8 TRANSFORM_ERROR=6
uint8 error
string error_string

SRV: tf2_msgs/FrameGraph
---
string frame_yaml

MSG: visualization_msgs/Marker
int32 ARROW=0
int32 CUBE=1
int32 SPHERE=2
int32 CYLINDER=3
int32 LINE_STRIP=4
int32 LINE_LIST=5
int32 CUBE_LIST=6
int32 SPHERE_LIST=7
int32 POINTS=8
int32 TEXT_VIEW_FACING=9
int32 MESH_RESOURCE=10
int32 TRIANGLE_LIST=11
int32 ADD=0
int32 MODIFY=0
int32 DELETE=2
int32 DELETEALL=3
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string text
string mesh_resource
bool mesh_use_embedded_materials

MSG: visualization_msgs/MarkerArray
visualization_msgs/Marker[] markers
"""
