"""Numbers, places and ways as people and models read them; control signs made visible."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from mapspeak.geometry import Point, Pose
from mapspeak.robot import PoseDoubt
from mapspeak.spatial.rooms import Region

Item = TypeVar("Item")

LONGEST_NAME = 40
POSE_DOUBTS = {
    PoseDoubt.NO_ANSWER: "the robot does not answer; state and pose are those heard last",
    PoseDoubt.NO_POSE: "the robot does not say where it is; the pose is the last one",
    PoseDoubt.OLD_POSE: "unless the robot stood still since, it is elsewhere; check that "
    "localisation runs and that the clocks agree",
    PoseDoubt.SILENT_POSE: "nothing new has come from what tells the pose; check that SLAM or "
    "localisation and the robot's drivers still run",
    PoseDoubt.CLOCK_STANDS: "the robot's clock stands; check that a simulation is not paused",
    PoseDoubt.ODOMETRY: "it is odometry, which drifts away from the map; start SLAM or "
    "localisation",
    PoseDoubt.CAMERA_TURN: "the robot's frames do not say to which side this camera looks; the "
    "heading is the robot's own",
}

COMPASS = (
    "east",
    "north-east",
    "north",
    "north-west",
    "west",
    "south-west",
    "south",
    "south-east",
)
"""Eighths of a turn from the map's x axis, counter-clockwise."""

KINDS = {"R": "a room", "C": "a corridor", "O": "an open space"}


def say_count(number: int, what: str) -> str:
    """Return "1 goal", "2 goals"."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def say_pose(pose: Pose) -> str:
    """Return a pose in metres and degrees."""
    return f"x {_number(pose.x)}, y {_number(pose.y)}, yaw {pose.yaw_deg + 0.0:.0f} deg"


def say_pose_doubt(doubt: PoseDoubt | None, age_s: float | None = None, silence: str = "") -> str:
    """Return why the robot may be elsewhere: a code, how old the pose is, and what to do."""
    if doubt is None:
        return ""
    is_age_told = age_s is not None and doubt is not PoseDoubt.ODOMETRY
    old = f"the pose is {age_s:.0f} s old: " if is_age_told else ""
    return " ".join(filter(None, (f"{doubt}: {old}{POSE_DOUBTS[doubt]}.", silence)))


def say_point(point: Point) -> str:
    """Return a point in metres."""
    return f"{_number(point.x)}, {_number(point.y)}"


def say_path(path_m: float | None) -> str:
    """Return a path's length, or "no way"."""
    return "no way" if path_m is None else f"{path_m:.1f}"


def say_compass(heading_rad: float) -> str:
    """Return a direction on the map, y being north: "north-east"."""
    return COMPASS[round(heading_rad / (math.tau / 8)) % 8]


def say_renamed(renamed: Mapping[str, str]) -> str:
    """Say what regions are called now that had another id; empty where none had."""
    return " ".join(
        f"{old} is called {new} now: it was taken for {KINDS[old[0]]} and is {KINDS[new[0]]}."
        for old, new in renamed.items()
    )


def say_kind(region: Region) -> str:
    """Return what a region is."""
    return str(region.room_class).replace("_", " ")


def shorten(text: str) -> str:
    """Return at most the first forty characters of a text on one line."""
    line = " ".join(text.split())
    return line if len(line) <= LONGEST_NAME else f"{line[: LONGEST_NAME - 3]}..."


def shorten_around(text: str, word: str, *, most: int) -> str:
    """Return a text on one line, where it is long the part around a word of it."""
    line = " ".join(text.split())
    at = line.find(word)
    if len(line) <= most or at < 0:
        return line[:most]
    start = min(max(at + len(word) // 2 - most // 2, 0), len(line) - most)
    before, behind = "..." if start else "", "..." if start + most < len(line) else ""
    return f"{before}{line[start : start + most]}{behind}"


def join_words(words: Iterable[str], nothing: str = "none") -> str:
    """Return words with a blank between them, or the word for none."""
    return " ".join(words) or nothing


def list_some(words: Sequence[str], *, most: int) -> str:
    """Return words with commas between them, and how many were left out."""
    told = ", ".join(words[:most])
    return told if len(words) <= most else f"{told} and {len(words) - most} more"


def build_table(
    heading: str,
    columns: Sequence[str],
    items: Sequence[Item],
    row: Callable[[Item], Sequence[str]],
    *,
    n_all: int | None = None,
    gap_after: int | None = None,
) -> str:
    """Return a heading, a line of columns and a line for each item.

    Args:
        heading: What the table shows.
        columns: Their names.
        items: What is listed.
        row: Gives an item's line.
        n_all: How many items there are; None where all are listed.
        gap_after: After so many lines those that are left out would stand; None for at the end.
    """
    if not items:
        return f"## {heading}: none"
    n_left_out = 0 if n_all is None else n_all - len(items)
    cut = f" (showing {len(items)} of {n_all})" if n_left_out else ""
    lines = [" | ".join(cell.replace("|", "/") for cell in row(item)) for item in items]
    if n_left_out and gap_after is not None:
        lines.insert(gap_after, f"... {n_left_out} more, in between, left out")
    return "\n".join([f"## {heading}{cut}", " | ".join(columns), *lines])


def _number(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}"


CONTROL = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b\u200e\u200f\u2028-\u202e\u2060-\u2069\ufeff]"
)
"""All but line feed and tabulator, and what turns the direction of reading or shows nothing."""


def show_controls(text: str) -> str:
    """Return a text with every control sign as it is written in JSON, such as u001b."""
    return CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)
