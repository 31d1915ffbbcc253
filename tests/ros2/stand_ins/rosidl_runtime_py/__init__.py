"""Stands in for ROS's rosidl_runtime_py, of which rosapi uses one function."""

import sys
from pathlib import Path


def get_interface_path(name: str) -> str:
    """Gives the file with the text of an interface, such as "std_msgs/msg/Header"."""
    for suffix in ("", ".msg", ".srv", ".action", ".idl"):
        path = Path(sys.prefix, "share", f"{name}{suffix}")
        if path.is_file():
            return str(path)
    raise LookupError(f"there is no interface {name}")
