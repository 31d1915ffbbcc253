"""Which map remembered places belong to: told from its walls, and moved when the map moves."""
