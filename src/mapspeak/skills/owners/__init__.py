"""skills.yaml: what the owner of a robot says that it can do."""
