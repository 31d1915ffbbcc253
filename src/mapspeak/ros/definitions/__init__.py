"""ROS types: definitions read, known ones, messages shown, checked and built."""
