"""Whether what is remembered can be true: findings that people can read, and what trust is left."""
