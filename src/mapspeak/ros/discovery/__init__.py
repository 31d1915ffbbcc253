"""What a robot offers, found by asking it, and overridden where a person knows better."""
