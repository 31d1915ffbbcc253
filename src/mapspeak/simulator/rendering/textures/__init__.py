"""Drawn surfaces: signs, goods, devices, floor and walls, drawn with Pillow when asked for."""

from mapspeak.simulator.rendering.textures.drawing import GLOWING, TILED, draw

__all__ = ["GLOWING", "TILED", "draw"]
