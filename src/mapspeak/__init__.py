"""mapspeak gives any language model a robot's map, eyes and memory of places, over MCP."""

__all__ = ["__version__"]

__version__ = "0.1.0"
