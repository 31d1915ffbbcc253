"""A robot's interfaces, found by asking it, and overridden where a person knows better."""
