"""Things to go to: by name, by what they are for, with and without a memory of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np

from mapspeak.evaluation.scores import BESIDE_M, Evidence, GroundTruth, judge_thing
from mapspeak.evaluation.tasks.task import dice, draw_start
from mapspeak.evaluation.trials import Limits, Score, Setting
from mapspeak.geometry import Pose

FIRE = "fire_extinguisher"
FIRE_WISH = "Fire detected nearby. Navigate to the tool used for it."
"""The paper's Task 3, word for word."""

WISHES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        FIRE: (
            "A waste paper basket is burning. Go to what puts it out.",
            "Something smoulders in here. Go to where I find what smothers the flames.",
        ),
        "first_aid_box": (
            "Somebody has cut a finger. Go to where plasters and bandages are kept.",
            "A colleague is bleeding. Go to what helps.",
        ),
        "exit_sign": (
            "Everybody has to leave the building. Go to what points out the way.",
            "I want to know where the way outside is marked. Go there.",
        ),
        "fire_hose_reel": (
            "The fire is too large for a hand-held device. Go to where water comes from the wall.",
        ),
        "eye_wash_station": (
            "Acid has splashed into somebody's face. Go to where it can be rinsed out of the eyes.",
        ),
        "ladder": (
            "A lamp near the ceiling is broken. Go to what I can climb up on to change it.",
        ),
        "charging_dock": (
            "Your battery runs low. Go to where you can get power.",
            "You look tired, robot. Go to where you are plugged in for the night.",
        ),
        "forklift": ("A heavy load has to be lifted onto a shelf. Go to the vehicle for that.",),
        "desk": (
            "I have to write a letter sitting down. Go to a place where people work on paper.",
        ),
        "cabinet": (
            "These papers have to be put away by the alphabet. Go to where files are kept.",
        ),
        "sofa": (
            "My back hurts, I would like to stretch out for a while. Go to where I can lie down.",
        ),
        "whiteboard": (
            "I would like to sketch an idea so that the whole team sees it. Go to where I can.",
        ),
        "printer": ("I need this document on paper. Go to the machine that puts it there.",),
        "fridge": ("The milk has to be kept cold. Go to where it does not go sour.",),
        "coffee_machine": (
            "I can hardly keep my eyes open. Go to where I get a hot drink for that.",
        ),
        "sink": ("My hands are sticky. Go to where I can wash them.",),
        "toilet": ("I have drunk too much tea and need some privacy. Go there.",),
        "trash_bin": (
            "I have finished my apple and hold the core. Go to where it can be thrown away.",
        ),
    }
)
"""By kind; each meant by nothing else in `mapspeak.simulator.worlds.models`."""


SEARCH_TOOLS = ("search_for", "look_around")
SEARCH_LIMITS = Limits(n_calls=200, robot_time_s=2400.0, wall_s=900.0)
OUT_OF_THE_WAY_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectRequest:
    """A thing as it is asked for.

    Attributes:
        prompt: The words.
        kind: What is meant.
    """

    prompt: str
    kind: str


class Draw(Protocol):
    """Draws a wish that a world can fulfil."""

    def __call__(self, site: GroundTruth, random: np.random.Generator) -> ObjectRequest:
        """Return the wish."""
        ...


def findable_kinds(site: GroundTruth) -> tuple[str, ...]:
    """Return the kinds one can wish for of which the robot can get to all things of the world."""
    kinds = sorted({thing.kind for thing in site.world.objects} & set(WISHES))
    return tuple(kind for kind in kinds if site.beside(kind).any())


def draw_wish(site: GroundTruth, random: np.random.Generator) -> ObjectRequest:
    """Draw a kind that the world has, and words for it."""
    kind = str(random.choice(findable_kinds(site)))
    words = WISHES[kind]
    return ObjectRequest(prompt=words[int(random.integers(len(words)))], kind=kind)


def ask_for_fire_tool(site: GroundTruth, random: np.random.Generator) -> ObjectRequest:
    """Return the paper's Task 3."""
    del site, random
    return ObjectRequest(prompt=FIRE_WISH, kind=FIRE)


def name_thing(site: GroundTruth, random: np.random.Generator) -> ObjectRequest:
    """Draw a kind that the world has, and names it."""
    kind = str(random.choice(findable_kinds(site)))
    return ObjectRequest(
        prompt=f"Find the nearest {site.label_of(kind)} and stop beside it.", kind=kind
    )


@dataclass(frozen=True, slots=True)
class ObjectTask:
    """The robot goes to a thing that it remembers."""

    name: str
    draw: Draw
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has such things."""
        if self.draw is ask_for_fire_tool:
            return bool(site.beside(FIRE).any())
        return bool(findable_kinds(site))

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Start anywhere but beside such a thing."""
        random = dice(self.name, site, seed)
        wish = self.draw(site, random)
        start, shortest_m = draw_start_apart(site, random, wish.kind)
        return Setting(
            prompt=wish.prompt,
            start=site.in_world(start),
            is_known=True,
            memory=memory,
            truth={"kind": wish.kind, "shortest_m": shortest_m},
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score what the robot stands beside."""
        return judge_thing(site, evidence, site.things(setting.truth["kind"]))


@dataclass(frozen=True, slots=True)
class SearchTask:
    """The robot finds a named thing in a building that it has never seen."""

    name: str = "search"
    needs_map: bool = False

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has such things."""
        return bool(findable_kinds(site))

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Start anywhere but beside such a thing, without map and memory."""
        del memory
        random = dice(self.name, site, seed)
        wish = name_thing(site, random)
        start, shortest_m = draw_start_apart(site, random, wish.kind)
        return Setting(
            prompt=wish.prompt,
            start=site.in_world(start),
            is_known=False,
            tools=(*SEARCH_TOOLS, "explore"),
            limits=SEARCH_LIMITS,
            truth={"kind": wish.kind, "shortest_m": shortest_m},
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score what the robot stands beside."""
        return judge_thing(site, evidence, site.things(setting.truth["kind"]))


def draw_start_apart(
    site: GroundTruth, random: np.random.Generator, kind: str
) -> tuple[Pose, float]:
    """Draw where the robot starts, and return the shortest way from there to a thing in sight."""
    beside = site.beside(kind)
    around = np.logical_or.reduce(
        [site.near(site.place_of(t), BESIDE_M + OUT_OF_THE_WAY_M) for t in site.things(kind)]
    )
    start = draw_start(site, random, without=around)
    return start, round(site.shortest_to_any_m(start.point, beside), 3)


OBJECT_TASKS = (
    ObjectTask("fire-tool", ask_for_fire_tool),
    ObjectTask("object", draw_wish),
    SearchTask(),
)
