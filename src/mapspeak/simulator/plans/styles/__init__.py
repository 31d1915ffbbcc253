"""The styles of buildings: how each is laid out."""

from mapspeak.simulator.plans.styles.catalogue import STYLES
from mapspeak.simulator.plans.styles.style import Building, Style

__all__ = ["STYLES", "Building", "Style"]
