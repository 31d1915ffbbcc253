"""What is made of the memory on the map: its things, how far to trust them, and a diary."""
