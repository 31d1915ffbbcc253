"""The memory for other programs, and two memories as one."""
