"""`mapspeak memory`: the memory of places without a robot."""
