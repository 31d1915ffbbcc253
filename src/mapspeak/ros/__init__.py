"""THE SECOND PORT: the queries and commands to a ROS system, over any connection.

`RosConnection` is to a whole ROS graph what `Robot` is to one robot: links implement it, and code
for any ROS robot uses it. Messages are mappings as rosbridge writes them.
"""
