"""`mapspeak map`: map files shown as a robot's map is shown, with no robot."""

from mapspeak.server.mapcommand.jobs import MapJob, Output, plan_jobs
from mapspeak.server.mapcommand.selection import MapSelection, find_maps
from mapspeak.server.mapcommand.showing import show_map

__all__ = ["MapJob", "MapSelection", "Output", "find_maps", "plan_jobs", "show_map"]
