"""The memory as a model reads and writes it: what is stored, found and noted, in words."""
