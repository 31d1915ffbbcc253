"""Going somewhere: checking goals, driving, exploring."""
