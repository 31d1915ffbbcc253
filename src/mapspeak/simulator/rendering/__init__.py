"""Drawing a world in software: from walls and models to triangles, light and pixels."""

from mapspeak.simulator.rendering.projection import Viewpoint
from mapspeak.simulator.rendering.scene import Scene, build_scene
from mapspeak.simulator.rendering.shading import draw_picture
from mapspeak.simulator.rendering.triangles import BUILDING
from mapspeak.simulator.rendering.visibility import Visibility, look

__all__ = ["BUILDING", "Scene", "Viewpoint", "Visibility", "build_scene", "draw_picture", "look"]
