"""Composed errands: what is done and said where, in which order, with skills that may fail."""

from collections.abc import Callable, Iterator
from typing import Any

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence, is_at, verdict
from mapspeak.evaluation.tasks.failures import find_doors
from mapspeak.evaluation.tasks.task import Draw, Task, Truth, point_text
from mapspeak.evaluation.tasks.things import (
    CLEARLY_FARTHER,
    SEARCH_TOOLS,
    findable_kinds,
    way_to,
)
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.geometry import Point
from mapspeak.server.app import DEFAULT_TOOLSETS
from mapspeak.simulator import MeasuredRoom, StateRecord, WorldDoor

LIMITS = Limits(n_calls=200, robot_time_s=3600.0, wall_s=900.0)
OPENING = "Errand, best run as one mission."
WORDS = ("All is well.", "It is here.", "Nobody is here.", "Mind the step.", "The way is free.")
DOCK = "charging_dock"
LOW_RATIO, ENOUGH_RATIO = 0.3, 0.35
"""Below the one the robot is to charge, to the other."""
EMPTY_RATIO, FULL_RATIO = 0.2, 0.8
MOST_ROOMS = 3
N_FAULTS = 2

Step = dict[str, Any]
"""The next required step: an action in the state log's format, and its place."""


def _say_at_thing(draw: Draw) -> tuple[str, Step]:
    kind = draw.one_of([each for each in findable_kinds(draw.site) if each != DOCK])
    words = draw.one_of(WORDS)
    text = f'go to the nearest {draw.site.label_of(kind)} and say "{words}" there'
    return text, {"deed": f"speak: {words}", "kind": kind}


def _say_in_room(draw: Draw, room: MeasuredRoom) -> tuple[str, Step]:
    words = draw.one_of(WORDS)
    middle = point_text(draw.site.middle_of(room))
    text = f'go to the space around {middle} and say "{words}" there'
    return text, {"deed": f"speak: {words}", "room": room.room.name}


def _rooms(draw: Draw, n_rooms: int) -> list[MeasuredRoom]:
    return draw.shuffled(draw.site.rooms)[:n_rooms]


def _setting(draw: Draw, parts: list[tuple[str, Step]], advice: str = "", **more: Any) -> Setting:  # noqa: ANN401 - fields of Setting
    """Return the setting of an errand whose parts are done one after the other."""
    told = ". Then ".join(text for text, _ in parts)
    prompt = " ".join(filter(None, (OPENING, advice, f"{told[0].upper()}{told[1:]}.")))
    truth = {"steps": [*more.pop("before", ()), *(step for _, step in parts)]}
    start = more.pop("start", None) or draw.start()
    return Setting(
        prompt=prompt,
        start=draw.site.in_world(start),
        is_known=True,
        memory=draw.memory,
        toolsets=(*DEFAULT_TOOLSETS, "missions"),
        tools=SEARCH_TOOLS,
        limits=LIMITS,
        truth=truth,
        **more,
    )


def _draw_fetch(draw: Draw) -> Setting:
    """Go to a thing and from there to a room."""
    (room,) = _rooms(draw, 1)
    return _setting(draw, [_say_at_thing(draw), _say_in_room(draw, room)])


def _draw_patrol(draw: Draw) -> Setting:
    return _setting(draw, [_say_in_room(draw, room) for room in _rooms(draw, MOST_ROOMS)])


def _draw_low_battery(draw: Draw) -> Setting:
    """Let the battery be low in every other trial: then, and only then, charging comes first."""
    (room,) = _rooms(draw, 1)
    is_low = draw.seed % 2 == 0
    advice = (
        f"If the battery is below {100 * LOW_RATIO:.0f} % when you begin, charge at the charging "
        f"dock to {100 * ENOUGH_RATIO:.0f} % before all else."
    )
    before = [{"deed": "dock: ", "battery_ratio": ENOUGH_RATIO}] if is_low else []
    return _setting(
        draw,
        [_say_in_room(draw, room)],
        advice,
        before=before,
        battery_ratio=EMPTY_RATIO if is_low else FULL_RATIO,
    )


def _draw_shut_door(draw: Draw) -> Setting:
    """Shut the only door of a room."""
    door, room = draw.one_of(_only_doors(draw.site))
    start = draw.start(without=draw.site.cells_of(room))
    advice = "A door that is shut opens on request, from right before it."
    part = _say_in_room(draw, room)
    return _setting(draw, [part], advice, start=start, shut=(door.name,))


def _only_doors(site: GroundTruth) -> list[tuple[WorldDoor, MeasuredRoom]]:
    """Return doors without which nothing leads into their rooms."""
    return [
        (door, room)
        for door, rooms in find_doors(site)
        for room in rooms
        if sum(room.room.name in passage.spaces for passage in site.passages) == 1
    ]


def _draw_faults(draw: Draw) -> Setting:
    advice = "The loudspeaker may fail twice before it works."
    return _setting(draw, [_say_at_thing(draw)], advice, n_faults={"speak": N_FAULTS})


# --- scores --------------------------------------------------------------------------------------


def _find_deeds(evidence: Evidence) -> Iterator[tuple[str, StateRecord]]:
    """Yield what was done, with how the simulation stood then, but for faults and opened doors."""
    n_told = 0
    for state in evidence.states:
        for deed in state.deeds[n_told:]:
            name = deed.partition(":")[0]
            if name != "open_door" and not name.endswith(" fault"):
                yield deed, state
        n_told = len(state.deeds)


def judge_errand(site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    """Judge whether all was done in its order and place, nothing else, and nothing was touched."""
    steps, done = truth["steps"], list(_find_deeds(evidence))
    n_right, before = 0, evidence.states[0].pose.point if evidence.states else evidence.end
    for step, (deed, state) in zip(steps, done, strict=False):
        here = state.pose.point
        if not _is_deed(step, deed) or not _is_place(site, step, here, before):
            break
        n_right, before = n_right + 1, here
    charged = [step["battery_ratio"] for step in steps if "battery_ratio" in step]
    at_last = done[-1][1].battery_ratio if done else 0.0
    figures = {
        "n_steps_right": float(n_right),
        "n_steps": float(len(steps)),
        "battery_ratio": at_last,
        "n_collisions": float(evidence.last.n_collisions),
    }
    said = f"{n_right} of {len(steps)} steps were done in order and place."
    if n_right < len(steps):
        return verdict(said, figures, failure=Failure.INCOMPLETE)
    if len(done) > len(steps):
        said = f"It did more than it was asked: {done[n_right][0]}."
        return verdict(said, figures, failure=Failure.WRONG_ANSWER)
    # Some of the charge is spent on the way.
    if charged and at_last < charged[0] - 0.02:
        said = f"The battery was at {100 * at_last:.0f} %."
        return verdict(said, figures, failure=Failure.INCOMPLETE)
    failure = Failure.COLLIDED if evidence.last.n_collisions else None
    return verdict(said, figures, failure=failure)


def _is_deed(step: Step, deed: str) -> bool:
    """Return True for what is asked for, word for word; which dock it is does not matter."""
    wanted = str(step["deed"])
    return deed == wanted or (wanted.endswith(": ") and deed.startswith(wanted))


def _is_place(site: GroundTruth, step: Step, here: Point, before: Point) -> bool:
    """Return True in the room, or beside the nearest thing by the way from where it was before."""
    if "room" in step:
        room = site.room_at(here)
        return room is not None and room.room.name == step["room"]
    if "kind" not in step:
        return True
    ways, things = site.ways_from(before), site.things(step["kind"])
    ways_m = {thing.name: way_to(site, ways, thing) for thing in things}
    most_m = CLEARLY_FARTHER * min(ways_m.values())
    return is_at(site, here, [thing for thing in things if ways_m[thing.name] <= most_m])


def _has_things(site: GroundTruth) -> bool:
    return any(kind != DOCK for kind in findable_kinds(site))


def _has_dock(site: GroundTruth) -> bool:
    return bool(site.things(DOCK)) and bool(site.beside(DOCK).any()) and bool(site.rooms)


_ERRANDS: tuple[tuple[str, Callable[[Draw], Setting], Callable[[GroundTruth], bool]], ...] = (
    ("errand-fetch", _draw_fetch, _has_things),
    ("errand-patrol", _draw_patrol, lambda site: len(site.rooms) > 1),
    ("errand-low-battery", _draw_low_battery, _has_dock),
    ("errand-shut-door", _draw_shut_door, lambda site: bool(_only_doors(site))),
    ("errand-faults", _draw_faults, _has_things),
)
ERRAND_TASKS = tuple(
    Task(name=name, draw=draw, judge=judge_errand, is_offered=is_offered)
    for name, draw, is_offered in _ERRANDS
)
