"""Plans of buildings, drawn from a seed and written as world files."""

from tools.worldgen.drawing import draw_plan, style_names
from tools.worldgen.laws import find_faults

__all__ = ["draw_plan", "find_faults", "style_names"]
