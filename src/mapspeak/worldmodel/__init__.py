"""The world model: the map, its rooms, what is remembered and what is closed, under ids."""
