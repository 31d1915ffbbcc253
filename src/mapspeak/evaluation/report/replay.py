"""A trial to be looked at again: its map and way, and every step with what was said and seen."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from mapspeak.evaluation.report.sheet import Album, Html, element, find_picture, paragraph, text
from mapspeak.evaluation.report.way import Course, StepMark, draw_way, lay_out_way
from mapspeak.evaluation.trials import PICTURES, TrialResult, Turn


def build_replay(result: TrialResult, folder: Path, course: Course, album: Album) -> Html:
    """Return the section of a trial, whose folder has its pictures; its id is the trial's."""
    trial = result.trial
    steps = {
        f"{trial.id}/step-{number}": turns
        for number, turns in enumerate(_group(course.turns), start=1)
    }
    poses = [(anchor, turns[-1].pose, turns[-1].robot_s) for anchor, turns in steps.items()]
    way = lay_out_way(course, poses)
    floor = paragraph("none", "There is no map of it.") if way is None else draw_way(way, album)
    stops = {} if way is None else way.stops
    shown = [
        _show_step(anchor, turns, stops.get(anchor), folder / PICTURES, album)
        for anchor, turns in steps.items()
    ]
    said = (
        element("ol", {"class": "steps"}, *shown)
        if shown
        else paragraph("none", "There is no conversation of it.")
    )
    summary = (
        show_standing(result),
        element("b", {}, text(f" {trial.task}")),
        text(f" {trial.world} {trial.number:03d}"),
        element("small", {}, text(f" {trial.answerer}, {trial.representation}")),
    )
    return element(
        "details",
        {"class": "trial", "id": trial.id},
        element("summary", {}, *summary),
        *_head(result, course),
        element("div", {"class": "replay"}, element("div", {"class": "floor"}, floor), said),
    )


def show_standing(result: TrialResult) -> Html:
    """Say in a coloured word how a trial ended."""
    if result.state.is_broken:
        return element("span", {"class": "word broken"}, text(result.state))
    if result.score.is_success:
        return element("span", {"class": "word good"}, text("done"))
    return element("span", {"class": "word bad"}, text("not done"))


def _head(result: TrialResult, course: Course) -> Iterator[Html]:
    for problem in course.problems:
        yield paragraph("problem", problem)
    failure = result.score.failure
    kind = "" if failure is None else f"{failure.replace('_', ' ')}: "
    yield paragraph("reason", f"{kind}{result.score.reason}")
    spent = [] if result.state.is_broken else _say_spent(result)
    facts = (result.state.replace("_", " "), *spent, f"seed {result.trial.seed}")
    yield paragraph("spent", ", ".join(facts))
    quotes = {"Asked": result.prompt, "Answered": result.answer, "Broken by": result.error}
    for who, said in quotes.items():
        if said:
            yield element("div", {"class": "quote"}, element("b", {}, text(who)), _words(said))


def _say_spent(result: TrialResult) -> list[str]:
    return [
        f"{result.driven_m:.1f} m driven",
        *([] if result.shortest_m is None else [f"{result.shortest_m:.1f} m at the shortest"]),
        f"{result.n_calls} calls ({result.n_errors} with errors)",
        f"{result.n_decisions} decisions",
        *_tokens(result),
        f"{result.robot_s:.0f} s robot time",
        f"{result.wall_s:.1f} s wall time",
        f"{result.n_collisions} collisions",
    ]


def _tokens(spent: TrialResult | Turn) -> list[str]:
    named = (
        (spent.n_input_tokens, "tokens read"),
        (spent.n_output_tokens, "tokens written"),
        (spent.n_picture_tokens, "of them pictures"),
    )
    return [f"{value:,} {name}" for value, name in named if value is not None]


def _group(turns: Sequence[Turn]) -> list[list[Turn]]:
    """Return what is shown at once: something said, or a call with its answer."""
    groups: list[list[Turn]] = []
    for turn in turns:
        if groups and _is_answer(turn, groups[-1][-1]):
            groups[-1].append(turn)
        else:
            groups.append([turn])
    return groups


def _is_answer(turn: Turn, before: Turn) -> bool:
    if turn.role != "tool" or before.role == "tool":
        return False
    return turn.call is not None and before.call is not None and turn.call.tool == before.call.tool


def _show_step(
    anchor: str, turns: Sequence[Turn], stop: StepMark | None, pictures: Path, album: Album
) -> Html:
    place: dict[str, object] = {}
    if stop is not None:
        place = {
            "data-u": stop.u,
            "data-v": stop.v,
            "data-heading": stop.heading_deg,
            "data-driven": stop.driven_ratio,
        }
    number = text(anchor.rpartition("-")[2])
    link = element("a", {"class": "number", "href": f"#{anchor}"}, number)
    shown = (_show_turn(turn, pictures, album) for turn in turns)
    return element("li", {"id": anchor, **place}, link, *shown)


def _show_turn(turn: Turn, pictures: Path, album: Album) -> Html:
    role = turn.role if turn.role in {"system", "user", "agent", "tool"} else "other"
    kind = "turn error" if turn.is_error else f"turn {role}"
    parts = [element("p", {"class": "who"}, *_say_who(turn))]
    if turn.text:
        parts.append(_words(turn.text))
    for name in turn.pictures:
        path = find_picture(pictures, name)
        if path is None:
            parts.append(paragraph("none", f"The picture {name} is missing."))
        else:
            parts.append(album.show(path, f"The picture {name} that the agent saw"))
    return element("div", {"class": kind}, *parts)


def _say_who(turn: Turn) -> Iterator[Html]:
    yield element("b", {}, text(turn.role))
    if turn.call is not None:
        yield text(" answers " if turn.role == "tool" else " calls ")
        yield element("code", {}, text(turn.call.tool))
        if turn.call.arguments:
            written = json.dumps(turn.call.arguments, ensure_ascii=False)
            yield element("code", {"class": "arguments"}, text(written))
    if turn.is_error:
        yield element("span", {"class": "word bad"}, text("error"))
    robot = [] if turn.robot_s is None else [f"robot {turn.robot_s:.1f} s"]
    when = (f"{turn.wall_s:.1f} s", *robot, *_tokens(turn))
    yield element("small", {}, text(", ".join(when)))


def _words(said: str) -> Html:
    return element("pre", {"tabindex": "0"} if said.count("\n") > 20 else {}, text(said))
