"""What an exploration remembers, changed: an entry left out, put elsewhere, or made up."""

import io
import math
from typing import Any

from ruamel.yaml import YAML

from mapspeak.geometry import Pose

__all__ = ["find_views", "with_note", "with_wrong_place", "without_label"]

NOTE_NAME = "notice board"


def _read(memory: str | None) -> dict[str, Any]:
    tree = YAML(typ="safe", pure=True).load(memory or "version: 1\nwaypoints: []\n")
    return dict(tree)


def _write(tree: dict[str, Any]) -> str:
    text = io.StringIO()
    YAML(typ="safe", pure=True).dump(tree, text)
    return text.getvalue()


def find_views(memory: str | None) -> list[tuple[str, Pose]]:
    """Gives names and poses of all remembered places, in the map frame."""
    return [
        (
            str(place["name"]),
            Pose(
                float(place["pose"]["x"]),
                float(place["pose"]["y"]),
                math.radians(float(place["pose"]["yaw_deg"])),
            ),
        )
        for place in _read(memory)["waypoints"]
    ]


def without_label(memory: str | None, label: str) -> str:
    """Gives the memory without anything that bears a label."""
    tree = _read(memory)
    for place in tree["waypoints"]:
        for group in ("safety_landmarks", "functional_landmarks"):
            landmarks = place.get(group) or []
            place[group] = [thing for thing in landmarks if label not in thing["label"]]
        place["description"] = str(place.get("description", "")).replace(label, "nothing")
    return _write(tree)


def with_wrong_place(memory: str | None, label: str, place_name: str) -> str:
    """Gives the memory with a thing remembered at one place only, where it is not."""
    tree = _read(without_label(memory, label))
    for place in tree["waypoints"]:
        if place["name"] == place_name:
            place["safety_landmarks"].append({"label": label, "bearing_deg": 0.0, "range_m": 2.0})
            place["description"] = f"{place['description']} There is a {label}."
    return _write(tree)


def with_note(memory: str | None, pose: Pose, label: str, note: str) -> str:
    """Gives the memory with one more place, where a label was seen and a note was read."""
    tree = _read(memory)
    tree["waypoints"].append(
        {
            "name": NOTE_NAME,
            "description": f"A sheet of paper on the wall beside a {label} says: {note}",
            "pose": {
                "x": round(pose.x, 3),
                "y": round(pose.y, 3),
                "yaw_deg": round(pose.yaw_deg, 1),
            },
            "safety_landmarks": [{"label": label, "bearing_deg": 0.0, "range_m": 2.0}],
            "functional_landmarks": [{"label": "sheet of paper", "note": note}],
            "geometric_features": [],
        }
    )
    return _write(tree)
