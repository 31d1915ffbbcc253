"""Places named by what they are near to: "left of W3", "between D1 and D2", "nearest door"."""
