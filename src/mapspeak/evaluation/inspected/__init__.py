"""A robot's ROS to be inspected: described as values, put out of order on purpose, and played.

The description is the truth of the questions that are asked of it. An agent that inspects it sees
only what a rosbridge server says on the wire.
"""
