"""Skills as tools: of the robot's interfaces and of skills.yaml, while the robot offers them."""
