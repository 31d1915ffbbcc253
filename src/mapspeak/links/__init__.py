"""The port implemented: one module per way of reaching a robot."""
