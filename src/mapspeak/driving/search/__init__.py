"""Finding a named thing: remembered places first, then where most that is unseen can be seen."""
