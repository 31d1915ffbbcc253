"""Finds what is remembered by the words that people use for it."""
