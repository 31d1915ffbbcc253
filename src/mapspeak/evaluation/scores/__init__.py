"""Scores: the truth of a world, what a trial left behind, and the judges that compare the two."""
