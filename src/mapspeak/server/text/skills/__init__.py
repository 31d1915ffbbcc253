"""Skills and missions in words."""
