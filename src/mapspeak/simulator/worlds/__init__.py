"""Worlds: their files, their walls and objects, and cuts through them."""
