"""From the words for a place to a pose: names, relations, where to stand, whether a goal works."""
