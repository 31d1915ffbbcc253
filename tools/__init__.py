"""What makes parts of the product, and does not ship with it."""
