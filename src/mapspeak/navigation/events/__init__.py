"""Closures and notices on the map: where they are, what they bar, and which ways they burden."""
