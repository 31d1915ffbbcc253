"""A flat whose truth a reader knows by heart, and what an exploration of it would have left."""

from pathlib import Path

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence
from mapspeak.evaluation.trials import (
    MAP,
    MEMORY,
    Score,
    Trial,
    TrialResult,
    TrialState,
    trial_folder,
    write_result,
)
from mapspeak.geometry import Point
from mapspeak.simulator import StateRecord, World, load_world
from mapspeak.spatial.mapfiles import MapMode
from mapspeak.spatial.mapwriting import write_map

FLAT = """
title: A flat with a hall, two rooms and a corridor beyond the small one.
start: {at: [1.0, 1.0], yaw_deg: 0}
walls:
  - line: [[0, 0], [11, 0], [11, 6], [0, 6], [0, 0]]
  - line: [[0, 3], [8, 3]]
  - line: [[5, 3], [5, 6]]
  - line: [[8, 0], [8, 6]]
doors:
  - {name: large room door, at: [2, 3], width_m: 1.0}
  - {name: small room door, at: [6.5, 3], width_m: 1.0}
  - {name: corridor door, at: [8, 4.5], width_m: 1.0}
rooms:
  - {name: hall, class: open_space, outline: [[0, 0], [8, 0], [8, 3], [0, 3]]}
  - {name: large room, class: room, outline: [[0, 3], [5, 3], [5, 6], [0, 6]]}
  - {name: small room, class: room, outline: [[5, 3], [8, 3], [8, 6], [5, 6]]}
  - {name: corridor, class: corridor, outline: [[8, 0], [11, 0], [11, 6], [8, 6]]}
objects:
  - {name: extinguisher, kind: fire_extinguisher, at: [7.9, 1.5], yaw_deg: 180}
  - {name: printer, kind: printer, at: [1.0, 5.4], yaw_deg: -90}
"""

MEMORY_TEXT = """version: 1
map: flat
waypoints:
  - name: view 1
    description: View of the hall.
    pose: {x: 5.0, y: 0.5, yaw_deg: 0.0}
    safety_landmarks:
      - {label: fire extinguisher, bearing_deg: 0.0, range_m: 1.9}
    functional_landmarks: []
    geometric_features: []
  - name: view 2
    description: View of the large room.
    pose: {x: 0.5, y: 2.7, yaw_deg: 90.0}
    safety_landmarks: []
    functional_landmarks:
      - {label: printer, bearing_deg: 15.0, range_m: 1.8}
    geometric_features: []
"""

LARGE_ROOM = Point(1.5, 3.5)
SMALL_ROOM = Point(5.5, 3.5)
CORRIDOR = Point(8.5, 2.0)
HALL = Point(1.0, 0.5)


def make_flat(folder: Path) -> World:
    """Writes the flat's file and gives the world; its map frame starts at (1, 1)."""
    path = folder / "flat.yaml"
    path.write_text(FLAT)
    return load_world(path)


def ended_at(
    *places: Point, yaw_rad: float = 0.0, n_collisions: int = 0, **more: object
) -> Evidence:
    """Gives what a trial leaves in which the robot came past some places of the map."""
    states, driven_m = [], 0.0
    for number, place in enumerate(places):
        driven_m += place.distance_to(places[number - 1]) if number else 1.0
        states.append(
            StateRecord(
                time_s=float(number),
                x=place.x,
                y=place.y,
                yaw_rad=yaw_rad,
                slam_error_m=0.0,
                driven_m=driven_m,
                n_collisions=n_collisions,
            )
        )
    return Evidence(states=tuple(states), **more)  # type: ignore[arg-type]  # as the test says


def prepare(run: Path, world: World, memory: str = MEMORY_TEXT) -> Trial:
    """Writes what an exploration would have left: a map without errors, and a memory."""
    trial = Trial(
        task="explore",
        world=world.name,
        seed=0,
        agent="scripted",
        representation="picture-table",
        number=1,
    )
    folder = trial_folder(run, trial)
    folder.mkdir(parents=True)
    write_map(GroundTruth(world).floor.visible, folder / MAP, mode=MapMode.RAW)
    (folder / MEMORY).write_text(memory)
    score = Score(is_success=True, reason="Drawn by hand.")
    write_result(run, TrialResult(trial=trial, prompt="", state=TrialState.FINISHED, score=score))
    return trial
