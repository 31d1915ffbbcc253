"""Plans of buildings, drawn from a seed and written as world files."""

from mapspeak.simulator.plans.drawing import draw_plan, style_names
from mapspeak.simulator.plans.laws import find_faults

__all__ = ["draw_plan", "find_faults", "style_names"]
