"""Recalling: what is remembered of a request, where it is, how sure, and where to stand for it."""
