"""`mapspeak serve`: what is served, and what draws it."""
