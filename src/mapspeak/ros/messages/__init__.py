"""ROS messages as rosbridge carries them, and our values: read and written, in both dialects.

What reads a message raises `LinkError` where it is none of that type.
"""

from mapspeak.ros.messages.fields import (
    NAME,
    TYPE,
    Dialect,
    Message,
    bare_type,
    read_header,
    read_stamp,
    write_header,
    write_stamp,
)
from mapspeak.ros.messages.grids import apply_grid_update, read_grid, write_grid
from mapspeak.ros.messages.pictures import (
    EncodedPicture,
    read_compressed_image,
    read_image,
    write_compressed_image,
)
from mapspeak.ros.messages.pixels import read_depth
from mapspeak.ros.messages.poses import (
    FramedPose,
    FrameTransform,
    Twist,
    read_pose,
    read_pose_stamped,
    read_pose_with_covariance,
    read_transforms,
    read_twist,
    write_odometry,
    write_pose,
    write_pose_stamped,
    write_pose_with_covariance,
    write_transforms,
    write_twist,
)
from mapspeak.ros.messages.scans import (
    CameraInfo,
    LaserScan,
    mend_scan,
    read_camera_info,
    read_scan,
    write_camera_info,
    write_scan,
)

__all__ = [
    "NAME",
    "TYPE",
    "CameraInfo",
    "Dialect",
    "EncodedPicture",
    "FrameTransform",
    "FramedPose",
    "LaserScan",
    "Message",
    "Twist",
    "apply_grid_update",
    "bare_type",
    "mend_scan",
    "read_camera_info",
    "read_compressed_image",
    "read_depth",
    "read_grid",
    "read_header",
    "read_image",
    "read_pose",
    "read_pose_stamped",
    "read_pose_with_covariance",
    "read_scan",
    "read_stamp",
    "read_transforms",
    "read_twist",
    "write_camera_info",
    "write_compressed_image",
    "write_grid",
    "write_header",
    "write_odometry",
    "write_pose",
    "write_pose_stamped",
    "write_pose_with_covariance",
    "write_scan",
    "write_stamp",
    "write_transforms",
    "write_twist",
]
