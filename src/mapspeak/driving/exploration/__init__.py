"""Exploring: frontier after frontier, until nothing is left or what is left cannot be reached."""
