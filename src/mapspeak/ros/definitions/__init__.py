"""What ROS types look like: definitions read, known ones, messages shown, checked and built."""
