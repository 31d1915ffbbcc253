"""What a robot can do besides driving: checked arguments, runs, skills.yaml, missions."""
