"""ROS messages as rosbridge carries them, and our values: read and written, in both dialects.

What reads a message raises `LinkError` where it is none of that type.
"""
