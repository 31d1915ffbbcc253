"""Things to go to: by name, by what they are for, with and without a memory of them."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from mapspeak.evaluation.scores.answers import Evidence
from mapspeak.evaluation.scores.judging import judge_thing
from mapspeak.evaluation.scores.site import BESIDE_M, GroundTruth
from mapspeak.evaluation.tasks.task import Draw, Task, Truth
from mapspeak.evaluation.trials import Limits, Score, Setting

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


def findable_kinds(site: GroundTruth) -> tuple[str, ...]:
    """Return the kinds one can wish for of which the robot can get to all things of the world."""
    kinds = sorted({thing.kind for thing in site.world.objects} & set(WISHES))
    return tuple(kind for kind in kinds if site.beside(kind).any())


def has_findable_kinds(site: GroundTruth) -> bool:
    """Return True where the world has things to go to."""
    return bool(findable_kinds(site))


def draw_wish(draw: Draw) -> tuple[str, str]:
    """Draw a kind that the world has; return words for it, and the kind."""
    kind = str(draw.random.choice(findable_kinds(draw.site)))
    return draw.one_of(WISHES[kind]), kind


def thing_setting(
    draw: Draw,
    prompt: str,
    kind: str,
    *,
    is_known: bool = True,
    tools: tuple[str, ...] = (),
    limits: Limits | None = None,
) -> Setting:
    """Return the setting of a drive to a thing of a kind, from anywhere but beside one."""
    site = draw.site
    around = np.logical_or.reduce(
        [site.near(site.place_of(t), BESIDE_M + OUT_OF_THE_WAY_M) for t in site.things(kind)]
    )
    start = draw.start(without=around)
    truth = {"kind": kind, "shortest_m": draw.shortest_m(start, site.beside(kind))}
    return draw.setting(prompt, start, truth, is_known=is_known, tools=tools, limits=limits)


def judge_kind(site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    """Score what the robot stands beside."""
    return judge_thing(site, evidence, site.things(truth["kind"]))


def _draw_search(draw: Draw) -> Setting:
    """Name a thing in a building that the robot has never seen, without map and memory."""
    kind = str(draw.random.choice(findable_kinds(draw.site)))
    prompt = f"Find the nearest {draw.site.label_of(kind)} and stop beside it."
    tools = (*SEARCH_TOOLS, "explore")
    return thing_setting(draw, prompt, kind, is_known=False, tools=tools, limits=SEARCH_LIMITS)


OBJECT_TASKS = (
    Task(
        name="fire-tool",
        draw=lambda draw: thing_setting(draw, FIRE_WISH, FIRE),
        judge=judge_kind,
        is_offered=lambda site: bool(site.beside(FIRE).any()),
    ),
    Task(
        name="object",
        draw=lambda draw: thing_setting(draw, *draw_wish(draw)),
        judge=judge_kind,
        is_offered=has_findable_kinds,
    ),
    Task(
        name="search",
        draw=_draw_search,
        judge=judge_kind,
        is_offered=has_findable_kinds,
        needs_map=False,
    ),
)
