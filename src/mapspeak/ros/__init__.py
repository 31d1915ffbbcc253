"""THE SECOND PORT: what a ROS system can be asked, over whatever connects us to it.

`RosConnection` is to a whole ROS graph what `Robot` is to one robot: links implement it, and what
works with any ROS robot is written against it. Messages are mappings as rosbridge writes them.
"""
