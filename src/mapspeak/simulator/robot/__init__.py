"""The simulated robot: its body, its LiDAR, its SLAM and its navigation."""
