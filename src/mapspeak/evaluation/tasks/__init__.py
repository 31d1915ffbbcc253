"""Tasks: what is asked, made for a world from its truth and a seed, and how it is scored."""
