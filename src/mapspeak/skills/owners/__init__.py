"""skills.yaml: the skills of a robot as its owner declares them."""
