"""Skills and missions in words: descriptions, conditions, trees, questions, interruptions."""

from collections.abc import Iterable, Iterator, Sequence

from mapspeak.memory.quoting import clean_line, quote
from mapspeak.server.text.offered import lead
from mapspeak.server.text.values import cut, show_message
from mapspeak.server.text.wording import say_count
from mapspeak.skill import (
    Arguments,
    JsonValue,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillState,
)
from mapspeak.skills.arguments import say_wanted
from mapspeak.skills.missions import Interrupted, MissionBounds
from mapspeak.skills.runs import Question, SkillRun
from mapspeak.skills.steps import Mission, Step, StepKind

MOST_SENTENCE = 300
MOST_WORDS = 80
MOST_QUOTE = 300
MOST_SKILLS = 100
MOST_STEPS_TOLD = 20
EFFECTS = {
    SkillEffect.READS: "It only reads.",
    SkillEffect.MOVES: "It may move the robot.",
    SkillEffect.CHANGES: "It changes something at the robot.",
}
CODES = {
    SkillCode.DONE: "",
    SkillCode.SENT: "It was published; what the robot makes of it is not told.",
    SkillCode.CANCELLED: "It was cancelled before it was done.",
    SkillCode.STOPPED: "The robot was stopped, or its server ended it, before it was done.",
    SkillCode.TOO_LATE: "It had not ended in time and was ended.",
    SkillCode.REJECTED: "The robot did not take it: check the arguments.",
    SkillCode.ABORTED: "The robot gave up.",
    SkillCode.LOST: "How it ended is not known: look at the robot, then run it again.",
    SkillCode.NOT_ANSWERED: "Nothing came in time.",
    SkillCode.PRECONDITION: "It was not begun.",
    SkillCode.NOT_ACHIEVED: "It ended, but its condition of success did not hold.",
}
ANSWERS = "{answer_mission} answers it."
GOES_ON = "It goes on. {skill_status} waits for it. {cancel_skill} ends it."
HEADS = {
    StepKind.SEQUENCE: "one after the other",
    StepKind.FALLBACK: "the first that succeeds of",
    StepKind.RETRY: "up to {times} times, until it succeeds",
    StepKind.REPEAT: "{times} times, as long as it succeeds",
    StepKind.TIMEOUT: "within {limit:g} s",
    StepKind.EVERY: "every {limit:g} min, {times} times",
    StepKind.UNTIL: "up to {times} times, until the last step succeeds",
}


def describe_skill(skill: Skill) -> str:
    """Return the description of a skill for a model; its owner's words are quoted."""
    needs = f"It needs: {say_conditions(skill.spec.needs)}." if skill.spec.needs else ""
    title, does = _title("Run the robot's skill", skill), EFFECTS[skill.spec.effect]
    return " ".join(filter(None, (title, does, needs, say_remark(skill))))


def _title(what: str, skill: Skill) -> str:
    name, description = skill.spec.name, skill.spec.description.removesuffix(".")
    said = f": {quote(description, most=MOST_SENTENCE)}" if description else ""
    return f"{what} {name}{said}."


def say_remark(*skills: Skill) -> str:
    """Return what people have said about missions since they were saved."""
    remarks = [said for each in skills if isinstance(each, Mission) for said in each.remember]
    told = (f"Remember, as a person said: {quote(said, most=MOST_SENTENCE)}." for said in remarks)
    return "\n".join(told)


def say_conditions(conditions: Arguments) -> str:
    """Return conditions in words."""
    return "; ".join(_say_condition(name, value) for name, value in conditions.items())


def _say_condition(name: str, value: JsonValue) -> str:
    match name:
        case "battery_above" | "battery_below":
            return f"the battery {name.removeprefix('battery_')} {100 * value:.0f} %"
        case "standing":
            return "the robot standing" if value else "the robot driving"
        case "in_room":
            return f"the robot in {_say_value(value)}"
        case "not" if isinstance(value, dict):
            return f"not {say_conditions(value)}"
    return f"{name.replace('_', ' ')} {_say_value(value)}"


def say_mission(mission: Mission, bounds: MissionBounds) -> str:
    """Return a mission as a tree, with its parameters and what it may do at most."""
    spec = mission.spec
    lines = [_title("Mission", mission)]
    for name, schema in spec.parameters.items():
        default = f", {schema['default']!r} when left out" if "default" in schema else ""
        lines.append(f"It takes {name}, {say_wanted(schema)}{default}.")
    lines += filter(None, [say_remark(mission), say_bounds(mission, bounds)])
    return "\n".join([*lines, *_draw(mission.tree, "", "")])


def say_bounds(mission: Mission, bounds: MissionBounds) -> str:
    """Return what a mission may do at most, and what people said about those within it."""
    asked = f" A person is asked for {', '.join(sorted(bounds.asked))}." if bounds.asked else ""
    counts = ((bounds.n_drives, "drive"), (bounds.n_commands, "other command"))
    does = " and ".join(say_count(n, what) for n, what in counts if n) or "0 drives"
    told = f"At most {does} within {mission.spec.timeout_s / 60:g} min.{asked}"
    return "\n".join(filter(None, [told, say_remark(*bounds.parts.values())]))


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


def draw_mission(mission: Mission) -> dict[str, JsonValue]:
    """Return a mission's tree as JSON, for a page that draws it."""

    def draw(step: Step) -> dict[str, JsonValue]:
        drawn = {"number": step.number, "kind": str(step.kind), "said": _say_step(step)}
        return {**drawn, "steps": [draw(each) for each in step.steps]}

    remember = list(mission.remember)
    return {"name": mission.spec.name, "remember": remember, "tree": draw(mission.tree)}


def say_run(run: SkillRun, steps_told: Sequence[str] = ()) -> str:
    """Return the state of a run, with its progress but steps told, its questions, or its result."""
    told, name = run.progress, run.skill.spec.name
    parts = [f"{run.handle} ({name}): {run.state} after {run.passed_s:.1f} s."]
    parts += [say_remark(run.skill), _say_account(told.account, steps_told)]
    if run.outcome is not None:
        parts.append(_say_outcome(run.outcome))
    elif run.error is not None:
        parts.append(str(run.error))
    else:
        if told.values:
            parts.append(f"latest progress of {run.n_progress}:\n{show_message(told.values)}")
        if run.is_asking:
            parts += [*map(say_question, run.runs.questions.waiting.values()), lead(ANSWERS)]
        parts.append(lead(GOES_ON))
    return cut("\n".join(filter(None, parts)))


def _say_account(account: Sequence[str], told: Sequence[str]) -> str:
    """Return the steps of a mission; they hold texts of others, and are quoted."""
    lines = [f"- {clean_line(each)}" for each in account if each not in told]
    n_told = len(account) - len(lines)
    head = f"Done, besides {say_count(n_told, 'step')} told before" if n_told else "Done"
    return "\n".join([f"{head} (observed, no instruction):", *lines]) if account else ""


def _say_outcome(outcome: SkillOutcome) -> str:
    numbers = ", ".join(f"{name} {value:g}" for name, value in outcome.numbers.items())
    parts = (
        CODES[outcome.code],
        f"It needs {say_conditions(outcome.unmet)}." if outcome.unmet else "",
        f"({numbers})" if numbers else "",
        f"The robot says: {quote(outcome.quote, most=MOST_QUOTE)}." if outcome.quote else "",
    )
    head = "result:" if outcome.state is SkillState.SUCCEEDED else "what it gave:"
    result = f"{head}\n{show_message(outcome.outputs)}" if outcome.outputs else ""
    return "\n".join(filter(None, (" ".join(filter(None, parts)), result)))


def say_question(question: Question) -> str:
    """Return a question with the answers that are taken."""
    given = question.given
    answers, fallback = given.get("answers"), given.get("otherwise")
    taken = f" Answers: {', '.join(map(_say_value, answers))}." if answers else ""
    about = "" if question.picture is None else f" About picture {given['picture']}."
    ends = "the step fails" if fallback is None else f"it is {_say_value(fallback)}"
    waits = f" It waits {given['within_s']:g} s; without an answer {ends}."
    return f"{question.id}: {quote(given['question'], most=MOST_SENTENCE)}.{taken}{waits}{about}"


def say_skills(skills: Iterable[Skill]) -> str:
    """Return all skills, a line each; their owners' words are quoted."""
    lines = []
    for spec in (each.spec for each in skills):
        said = f": {quote(spec.description, most=120)}" if spec.description else ""
        takes = ", ".join(spec.parameters) or "nothing"
        lines.append(f"- {spec.name}({takes}), {spec.effect}{said}")
    rest = f"and {len(lines) - MOST_SKILLS} more." if len(lines) > MOST_SKILLS else ""
    return "\n".join(filter(None, ["Skills:", *lines[:MOST_SKILLS], rest]))


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
