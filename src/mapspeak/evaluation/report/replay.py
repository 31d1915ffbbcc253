"""A trial to be looked at again: its map and way, and every step with what was said and seen."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from mapspeak.evaluation.report.sheet import Album, Html, element, find_picture, joined, text
from mapspeak.evaluation.report.way import Course, StepMark, draw_way, lay_out_way
from mapspeak.evaluation.trials import PICTURES, TrialResult, Turn


@dataclass(frozen=True, slots=True, kw_only=True)
class _Step:
    """What is shown at once: something said, or a call with its answer."""

    anchor: str
    turns: tuple[Turn, ...]

    @property
    def last(self) -> Turn:
        return self.turns[-1]


def build_replay(result: TrialResult, folder: Path, course: Course, album: Album) -> Html:
    """Return the section of a trial; its id is the trial's.

    Args:
        result: What came of it.
        folder: The trial's.
        course: How it went.
        album: Takes the pictures.
    """
    trial = result.trial
    steps = tuple(_group(trial.id, course.turns))
    way = lay_out_way(course, [(step.anchor, step.last.pose, step.last.robot_s) for step in steps])
    if way is None:
        floor = element("p", {"class": "none"}, text("There is no map of it."))
    else:
        floor = draw_way(way, album)
    stops = {} if way is None else way.stops
    return element(
        "details",
        {"class": "trial", "id": trial.id},
        _summary(result),
        *_head(result, course),
        element(
            "div",
            {"class": "replay"},
            element("div", {"class": "floor"}, floor),
            _list_steps(steps, stops, folder / PICTURES, album),
        ),
    )


def show_standing(result: TrialResult) -> Html:
    """Say in a coloured word how a trial ended."""
    if result.state.is_broken:
        return element("span", {"class": "word broken"}, text(result.state))
    if result.score.is_success:
        return element("span", {"class": "word good"}, text("done"))
    return element("span", {"class": "word bad"}, text("not done"))


def _summary(result: TrialResult) -> Html:
    trial = result.trial
    return element(
        "summary",
        {},
        show_standing(result),
        element("b", {}, text(f" {trial.task}")),
        text(f" {trial.world} {trial.number:03d}"),
        element("small", {}, text(f" {trial.answerer}, {trial.representation}")),
    )


def _head(result: TrialResult, course: Course) -> Iterator[Html]:
    for problem in course.problems:
        yield element("p", {"class": "problem"}, text(problem))
    failure = result.score.failure
    kind = "" if failure is None else f"{failure.replace('_', ' ')}: "
    yield element("p", {"class": "reason"}, text(f"{kind}{result.score.reason}"))
    spent = [] if result.state.is_broken else _say_spent(result)
    facts = (result.state.replace("_", " "), *spent, f"seed {result.trial.seed}")
    yield element("p", {"class": "spent"}, text(", ".join(facts)))
    if result.prompt:
        yield _quote("Asked", result.prompt)
    if result.answer:
        yield _quote("Answered", result.answer)
    if result.error is not None:
        yield _quote("Broken by", result.error)


def _say_spent(result: TrialResult) -> list[str]:
    return [
        f"{result.driven_m:.1f} m driven",
        *([] if result.shortest_m is None else [f"{result.shortest_m:.1f} m at the shortest"]),
        f"{result.n_calls} calls ({result.n_errors} with errors)",
        f"{result.n_decisions} decisions",
        *_tokens(result.n_input_tokens, result.n_output_tokens, result.n_picture_tokens),
        f"{result.robot_s:.0f} s robot time",
        f"{result.wall_s:.1f} s wall time",
        f"{result.n_collisions} collisions",
    ]


def _quote(who: str, said: str) -> Html:
    return element("div", {"class": "quote"}, element("b", {}, text(who)), _words(said))


def _tokens(read: int | None, written: int | None, pictures: int | None) -> list[str]:
    named = ((read, "tokens read"), (written, "tokens written"), (pictures, "of them pictures"))
    return [f"{value:,} {name}" for value, name in named if value is not None]


def _group(trial_id: str, turns: Sequence[Turn]) -> Iterator[_Step]:
    """Join each call with its answer."""
    groups: list[list[Turn]] = []
    for turn in turns:
        before = groups[-1][-1] if groups else None
        if before is not None and _is_answer(turn, before):
            groups[-1].append(turn)
        else:
            groups.append([turn])
    for number, group in enumerate(groups, start=1):
        yield _Step(anchor=f"{trial_id}/step-{number}", turns=tuple(group))


def _is_answer(turn: Turn, before: Turn) -> bool:
    if turn.role != "tool" or before.role == "tool":
        return False
    return turn.call is not None and before.call is not None and turn.call.tool == before.call.tool


def _list_steps(
    steps: Sequence[_Step], stops: dict[str, StepMark], pictures: Path, album: Album
) -> Html:
    if not steps:
        return element("p", {"class": "none"}, text("There is no conversation of it."))
    shown = (_show_step(step, stops.get(step.anchor), pictures, album) for step in steps)
    return element("ol", {"class": "steps"}, *shown)


def _show_step(step: _Step, stop: StepMark | None, pictures: Path, album: Album) -> Html:
    place: dict[str, object] = {}
    if stop is not None:
        place = {
            "data-u": stop.u,
            "data-v": stop.v,
            "data-heading": stop.heading_deg,
            "data-driven": stop.driven_ratio,
        }
    number = step.anchor.rpartition("-")[2]
    link = element("a", {"class": "number", "href": f"#{step.anchor}"}, text(number))
    parts = joined(_show_turn(turn, pictures, album) for turn in step.turns)
    return element("li", {"id": step.anchor, **place}, link, parts)


def _show_turn(turn: Turn, pictures: Path, album: Album) -> Html:
    kind = "turn error" if turn.is_error else f"turn {_role(turn)}"
    parts = [element("p", {"class": "who"}, *_say_who(turn))]
    if turn.text:
        parts.append(_words(turn.text))
    parts += (_show_picture(name, pictures, album) for name in turn.pictures)
    return element("div", {"class": kind}, *parts)


def _role(turn: Turn) -> str:
    return turn.role if turn.role in {"system", "user", "agent", "tool"} else "other"


def _say_who(turn: Turn) -> Iterator[Html]:
    yield element("b", {}, text(turn.role))
    if turn.call is not None:
        verb = " answers " if turn.role == "tool" else " calls "
        yield text(verb)
        yield element("code", {}, text(turn.call.tool))
        if turn.call.arguments:
            written = json.dumps(turn.call.arguments, ensure_ascii=False)
            yield element("code", {"class": "arguments"}, text(written))
    if turn.is_error:
        yield element("span", {"class": "word bad"}, text("error"))
    when = [f"{turn.wall_s:.1f} s"]
    if turn.robot_s is not None:
        when.append(f"robot {turn.robot_s:.1f} s")
    when += _tokens(turn.n_input_tokens, turn.n_output_tokens, turn.n_picture_tokens)
    yield element("small", {}, text(", ".join(when)))


def _words(said: str) -> Html:
    return element("pre", {"tabindex": "0"} if said.count("\n") > 20 else {}, text(said))


def _show_picture(name: str, pictures: Path, album: Album) -> Html:
    path = find_picture(pictures, name)
    if path is None:
        return element("p", {"class": "none"}, text(f"The picture {name} is missing."))
    return album.show(path, f"The picture {name} that the agent saw")
