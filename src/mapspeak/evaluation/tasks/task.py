"""The port of tasks: what is asked of a world, and how the answer is scored."""

import zlib
from typing import Protocol

import numpy as np

from mapspeak.evaluation.scores import Evidence, GroundTruth
from mapspeak.evaluation.trials import Score, Setting
from mapspeak.geometry import Point, Pose
from mapspeak.spatial.grid import Mask


class Task(Protocol):
    """A kind of question; the same world, seed and memory give the same setting."""

    @property
    def name(self) -> str:
        """Return its name, such as "smallest-room"."""
        ...

    @property
    def needs_map(self) -> bool:
        """True where it starts from the map and memory of an exploration."""
        ...

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has what it asks about."""
        ...

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Make one trial's setting.

        Args:
            site: A world in which it is offered.
            seed: Of everything that is drawn.
            memory: The semantic map that an exploration of the world has left, as YAML.
        """
        ...

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score a trial by the truth of the world as it was set: with what was added to it."""
        ...


def dice(task: str, site: GroundTruth, seed: int) -> np.random.Generator:
    """Return the generator of a trial's draws: another for each task, world and seed."""
    names = (zlib.crc32(text.encode()) for text in (task, site.world.name))
    return np.random.default_rng([seed, *names])


def draw_start(
    site: GroundTruth, random: np.random.Generator, *, without: Mask | None = None
) -> Pose:
    """Draw where the robot starts, in the map frame: somewhere roomy, not where it is to go."""
    elsewhere = None if without is None else ~without
    is_left = elsewhere is not None and bool((site.roomy & elsewhere).any())
    return site.draw_pose(random, elsewhere if is_left else None)


def drive_setting(
    site: GroundTruth, *, prompt: str, start: Pose, right: Mask, memory: str | None, **truth: object
) -> Setting:
    """Return the setting of a drive on a finished map.

    Args:
        site: The world.
        prompt: What is asked.
        start: Where the robot stands, in the map frame.
        right: Cells of the map any of which will do; `shortest_m` is the way to the nearest.
        memory: What the robot remembers.
        truth: What else the scorer has to know.
    """
    shortest_m = round(site.shortest_to_any_m(start.point, right), 3)
    return Setting(
        prompt=prompt,
        start=site.in_world(start),
        is_known=True,
        memory=memory,
        truth={**truth, "shortest_m": shortest_m},
    )


def point_text(point: Point) -> str:
    """Return a point as prompts and answers write it."""
    return f"({point.x:.2f}, {point.y:.2f})"
