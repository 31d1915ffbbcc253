"""Missions: trees of skills that the server runs by itself."""
