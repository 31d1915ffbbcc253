"""ROS messages as rosbridge carries them, and our values: read and written, in both dialects.

Readers raise `LinkError` for a message that is not of their type.
"""
