"""Missions in words: the tree, its bounds, its questions, what was interrupted."""

from collections.abc import Iterable, Iterator

from mapspeak.memory.quoting import quote
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import say_count
from mapspeak.skill import JsonValue, Skill, SkillParameter
from mapspeak.skills.arguments import say_wanted
from mapspeak.skills.missions.questions import Question, QuestionBook
from mapspeak.skills.missions.record import Interrupted
from mapspeak.skills.missions.tree import MissionBounds, MissionPlan, Step, StepKind

MOST_WORDS = 80
MOST_SKILLS = 100
MOST_STEPS_TOLD = 20
HEADS = {
    StepKind.SEQUENCE: "one after the other",
    StepKind.FALLBACK: "the first that succeeds of",
    StepKind.RETRY: "up to {times} times, until it succeeds",
    StepKind.REPEAT: "{times} times, as long as it succeeds",
    StepKind.TIMEOUT: "within {limit:g} s",
    StepKind.EVERY: "every {limit:g} min, {times} times",
    StepKind.UNTIL: "up to {times} times, until the last step succeeds",
}


def say_plan(plan: MissionPlan, bounds: MissionBounds) -> str:
    """Return a mission as a tree, with its parameters and what it may do at most."""
    spec = plan.spec
    said = f": {quote(spec.description, most=300)}" if spec.description else ""
    lines = [f"Mission {spec.name}{said}."]
    lines += [f"It takes {_say_parameter(each)}." for each in spec.parameters]
    lines += [f"Remember, as a person said: {quote(each, most=300)}." for each in plan.remember]
    lines += [say_bounds(bounds, spec.timeout_s), *_draw(plan.tree, "", "")]
    return "\n".join(lines)


def say_bounds(bounds: MissionBounds, timeout_s: float) -> str:
    """Return what a mission may do at most."""
    asked = f" A person is asked for {', '.join(sorted(bounds.asked))}." if bounds.asked else ""
    return (
        f"At most {say_count(bounds.n_drives, 'drive')} and "
        f"{say_count(bounds.n_commands, 'other command')} within {timeout_s / 60:g} min.{asked}"
    )


def _say_parameter(parameter: SkillParameter) -> str:
    default = "" if parameter.default is None else f", {parameter.default!r} when left out"
    return f"{parameter.name}, {say_wanted(parameter)}{default}"


def _draw(step: Step, indent: str, tail: str) -> Iterator[str]:
    yield f"{indent}{step.number} {_say_step(step)}"
    for index, each in enumerate(step.steps):
        is_last = index == len(step.steps) - 1
        deeper = tail + ("   " if is_last else "|  ")
        yield from _draw(each, tail + ("`- " if is_last else "|- "), deeper)


def _say_step(step: Step) -> str:
    if step.kind is StepKind.PARALLEL:
        return "at once, all of" if step.needs_all else "at once, until one has succeeded"
    if step.kind is not StepKind.LEAF:
        return HEADS[step.kind].format(times=step.times, limit=step.limit)
    named = [f"{name}={_say_value(each)}" for name, each in step.arguments.items()]
    given = [] if step.main is None else [_say_value(step.main)]
    result = f" -> {step.output}" if step.output else ""
    return " ".join(filter(None, [step.skill, ", ".join([*given, *named])])) + result


def _say_value(value: JsonValue) -> str:
    return quote(value, most=MOST_WORDS) if isinstance(value, str) else str(value)[:MOST_WORDS]


def draw_plan(plan: MissionPlan) -> dict[str, JsonValue]:
    """Return a mission's tree as JSON, for a page that draws it."""

    def draw(step: Step) -> dict[str, JsonValue]:
        return {
            "number": step.number,
            "kind": str(step.kind),
            "said": _say_step(step),
            "steps": [draw(each) for each in step.steps],
        }

    return {"name": plan.spec.name, "remember": list(plan.remember), "tree": draw(plan.tree)}


def say_question(question: Question) -> str:
    """Return a question with the answers that are taken."""
    taken = f" Answers: {', '.join(map(_say_value, question.answers))}." if question.answers else ""
    about = "" if question.picture is None else f" About picture {question.picture.id}."
    return f"{question.id}: {quote(question.text, most=300)}.{taken}{about}"


def say_waiting(questions: QuestionBook) -> str:
    """Return the questions that wait, with how they are answered."""
    asked = [say_question(each) for each in questions.waiting]
    return "\n".join([*asked, lead("{answer_mission} answers it.")]) if asked else ""


def say_skills(skills: Iterable[Skill]) -> str:
    """Return all skills, a line each; their owners' words are quoted."""
    lines = []
    for each in skills:
        spec = each.spec
        takes = ", ".join(parameter.name for parameter in spec.parameters) or "nothing"
        said = f": {quote(spec.description, most=120)}" if spec.description else ""
        lines.append(f"- {spec.name}({takes}), {spec.effect}{said}")
    shown = lines[:MOST_SKILLS]
    rest = f"\nand {len(lines) - MOST_SKILLS} more." if len(lines) > MOST_SKILLS else ""
    return "Skills:\n" + "\n".join(shown) + rest


def say_interrupted(interrupted: Iterable[Interrupted]) -> str:
    """Return which missions an earlier server did not live to end, and what they had done."""
    told = []
    for each in interrupted:
        steps = "".join(f"\n- {quote(step, most=200)}" for step in each.steps[-MOST_STEPS_TOLD:])
        told.append(
            f"INTERRUPTED: the mission {each.name}, begun {each.begun}: its server ended. "
            f"It does not go on by itself.{steps and ' Done:'}{steps}"
        )
    return "\n".join(told)
