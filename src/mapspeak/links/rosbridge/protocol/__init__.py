"""The rosbridge protocol without I/O: frames in, events out; operations as text."""
