"""The simulated camera: a world drawn in software, from walls and models to pixels."""
