"""Drives as jobs: sent, watched, ended; exploration, search and routes made of them."""
