"""The map as a model sees it: the world in pictures, tables and numbers, under the same ids."""
