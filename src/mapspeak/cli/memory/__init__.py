"""`mapspeak memory`: the remembered places and observations, without a robot."""

from mapspeak.cli.memory.commands import memory

__all__ = ["memory"]
