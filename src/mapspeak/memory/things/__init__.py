"""Things, joined out of what was seen of them from several places, and where they stand."""
