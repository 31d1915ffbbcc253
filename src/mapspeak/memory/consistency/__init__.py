"""Consistency checks of remembered places: findings, and the trust that remains."""
