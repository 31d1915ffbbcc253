"""Things to go to: by name, by what they are for, with and without a memory of them."""

from functools import cache
from importlib import resources

import numpy as np
from ruamel.yaml import YAML

from mapspeak.evaluation.scores.judging import Evidence, judge_thing
from mapspeak.evaluation.scores.site import BESIDE_M, GroundTruth
from mapspeak.evaluation.tasks.task import Draw, Task, Truth
from mapspeak.evaluation.trials import Limits, Score, Setting

FIRE = "fire_extinguisher"
FIRE_WISH = "Fire detected nearby. Navigate to the tool used for it."
"""The paper's Task 3, word for word."""

SEARCH_TOOLS = ("search_for", "look_around")
SEARCH_LIMITS = Limits(n_calls=200, robot_time_s=2400.0, wall_s=900.0)
OUT_OF_THE_WAY_M = 1.0


@cache
def _wishes() -> dict[str, list[str]]:
    """Return what people say when they want a thing, by its kind."""
    text = resources.files(__package__).joinpath("wishes.yaml").read_text(encoding="utf-8")
    return dict(YAML(typ="safe", pure=True).load(text))


def findable_kinds(site: GroundTruth) -> tuple[str, ...]:
    """Return the kinds one can wish for of which the robot can get to all things of the world."""
    kinds = sorted({thing.kind for thing in site.world.objects} & set(_wishes()))
    return tuple(kind for kind in kinds if site.beside(kind).any())


def has_findable_kinds(site: GroundTruth) -> bool:
    """Return True where the world has things to go to."""
    return bool(findable_kinds(site))


def draw_wish(draw: Draw) -> tuple[str, str]:
    """Draw a kind that the world has; return words for it, and the kind."""
    kind = str(draw.random.choice(findable_kinds(draw.site)))
    return draw.one_of(_wishes()[kind]), kind


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
