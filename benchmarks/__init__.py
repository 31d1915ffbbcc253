"""Measurements of mapspeak, one module each; `./run bench` runs them."""
