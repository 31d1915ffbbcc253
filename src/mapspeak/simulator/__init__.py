"""A world with one robot, stepped by hand: no clock, no network, no port."""
