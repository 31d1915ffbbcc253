"""Find by walls which map remembered places belong to; move them when the map moves."""
