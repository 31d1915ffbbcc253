"""What several commands take and open: options, robots, the guard."""
