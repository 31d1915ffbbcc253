"""The map as a model sees it: one atlas in pictures, tables and numbers, under the same ids."""
