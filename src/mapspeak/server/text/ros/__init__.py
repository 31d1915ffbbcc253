"""The words of the tools of ROS: what there is, what came, what was sent, what cannot be."""
