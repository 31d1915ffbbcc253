"""A small building in which all that the simulated robot can do has its place."""

from pathlib import Path

from mapspeak.simulator import World, load_world

WORKSHOP = """
title: A hall with a dock, a forklift and a pallet, and a store behind a shut door.
start: {at: [2.0, 1.5], yaw_deg: 180}
battery_percent: 40
walls:
  - line: [[0, 0], [9, 0], [9, 3], [0, 3], [0, 0]]
  - line: [[6, 0], [6, 3]]
doors:
  - {name: store door, at: [6, 1.5], width_m: 1.1, shut: true}
rooms:
  - {name: hall, class: room, outline: [[0, 0], [6, 0], [6, 3], [0, 3]]}
  - {name: store, class: room, outline: [[6, 0], [9, 0], [9, 3], [6, 3]]}
objects:
  - {name: dock, kind: charging_dock, at: [0.06, 1.5], yaw_deg: 0}
  - {name: forklift, kind: forklift, at: [4.3, 0.6], yaw_deg: 0}
  - {name: pallet, kind: pallet, at: [3.4, 2.5], yaw_deg: 90}
"""


def make_workshop(folder: Path, text: str = WORKSHOP) -> World:
    """Write the workshop's file and return the world."""
    path = folder / "workshop.yaml"
    path.write_text(text)
    return load_world(path)
