"""Looking at places: which way to face, from where a place is in view, and what should be."""
