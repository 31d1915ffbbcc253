"""THE SECOND PORT: what a ROS system can be asked, over whatever connects us to it.

`RosConnection` is to a whole ROS graph what `Robot` is to one robot: links implement it, and what
works with any ROS robot is written against it. Messages are mappings as rosbridge writes them.
"""

from mapspeak.ros.activity import (
    REFUSED,
    ActionEnd,
    ActionGoal,
    Listener,
    Startable,
    Started,
    Subscription,
)
from mapspeak.ros.messages import NAME, TYPE
from mapspeak.ros.port import (
    LinkKind,
    LinkName,
    NodeLinks,
    OwnEnds,
    RosConnection,
    RosGraph,
    find_nearest,
    has_listeners,
    new_id,
    started_over,
)

__all__ = [
    "NAME",
    "REFUSED",
    "TYPE",
    "ActionEnd",
    "ActionGoal",
    "LinkKind",
    "LinkName",
    "Listener",
    "NodeLinks",
    "OwnEnds",
    "RosConnection",
    "RosGraph",
    "Startable",
    "Started",
    "Subscription",
    "find_nearest",
    "has_listeners",
    "new_id",
    "started_over",
]
