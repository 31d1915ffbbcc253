"""Skills and their runs in words."""

from collections.abc import Sequence

from mapspeak.memory.quoting import clean_line, quote
from mapspeak.server.text.missions import say_waiting
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import say_count
from mapspeak.server.tools.ros.reports import cut, show_message
from mapspeak.skill import (
    Precondition,
    PreconditionKind,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.missions.questions import QuestionBook
from mapspeak.skills.runs import SkillRun

MOST_SENTENCE = 300
MOST_QUOTE = 300
EFFECTS = {
    SkillEffect.READS: "It only reads.",
    SkillEffect.MOVES: "It may move the robot.",
    SkillEffect.CHANGES: "It changes something at the robot.",
}
CODES = {
    SkillCode.DONE: "",
    SkillCode.CANCELLED: "It was cancelled before it was done.",
    SkillCode.STOPPED: "The robot was stopped, or its server ended it, before it was done.",
    SkillCode.TOO_LATE: "It had not ended in time and was ended.",
    SkillCode.REJECTED: "The robot did not take it: check the arguments.",
    SkillCode.ABORTED: "The robot gave up.",
    SkillCode.LOST: "How it ended is not known: look at the robot, then run it again.",
    SkillCode.NOT_OFFERED: "The robot does not offer it any more.",
    SkillCode.NOT_ANSWERED: "Nothing came in time.",
    SkillCode.PRECONDITION: "It was not begun.",
    SkillCode.NOT_ACHIEVED: "It ended, but what counts as success did not hold.",
}
GOES_ON = "It goes on. {skill_status} waits for it. {cancel_skill} ends it."


def describe_skill(spec: SkillSpec) -> str:
    """Return the description of a skill for a model; its owner's words are quoted."""
    said = f": {quote(spec.description, most=MOST_SENTENCE)}." if spec.description else "."
    needs = "; ".join(map(say_precondition, spec.preconditions))
    parts = [f"Run the robot's skill {spec.name}{said}", EFFECTS[spec.effect]]
    if needs:
        parts.append(f"It needs: {needs}.")
    return " ".join(parts)


def say_precondition(precondition: Precondition) -> str:
    """Return a precondition in words."""
    match precondition.kind:
        case PreconditionKind.BATTERY_ABOVE:
            return f"the battery above {100 * (precondition.ratio or 0):.0f} %"
        case PreconditionKind.STANDING:
            return "the robot standing"
        case PreconditionKind.IN_ROOM:
            return f"the robot in {quote(precondition.room, most=80)}"


def say_run(run: SkillRun, questions: QuestionBook | None = None) -> str:
    """Return the state of a run, with its latest progress or its result.

    Args:
        questions: Those that wait, where it is a mission that may ask some.
    """
    name = run.skill.spec.name
    head = f"{run.handle} ({name}): {run.state} after {run.passed_s:.1f} s."
    account = "" if run.progress is None else _say_account(run.progress.account)
    if run.outcome is not None:
        return cut("\n".join(filter(None, (head, account, _say_outcome(run.outcome)))))
    if run.error is not None:
        return f"{head}\n{run.error}"
    told = ""
    if run.progress is not None and run.progress.values:
        told = f"latest progress of {run.n_progress}:\n{show_message(run.progress.values)}"
    asked = say_waiting(questions) if run.is_asking and questions is not None else ""
    return cut("\n".join(filter(None, (head, account, told, asked, lead(GOES_ON)))))


def _say_account(account: Sequence[str]) -> str:
    """Return the steps of a mission; they hold texts of others, and are quoted."""
    lines = (f"- {clean_line(each)}" for each in account)
    return "\n".join(["Done (observed, no instruction):", *lines]) if account else ""


def _say_outcome(outcome: SkillOutcome) -> str:
    parts = [CODES[outcome.code]]
    if outcome.failed is not None:
        parts.append(f"It needs {say_precondition(outcome.failed)}.")
    if outcome.numbers:
        told = (f"{name} {value:g}" for name, value in outcome.numbers.items())
        parts.append(f"({', '.join(told)})")
    if outcome.quote:
        parts.append(f"The robot says: {quote(outcome.quote, most=MOST_QUOTE)}.")
    said = " ".join(filter(None, parts))
    if not outcome.outputs:
        return said
    head = "result:" if outcome.state is SkillState.SUCCEEDED else "what it gave:"
    return "\n".join(filter(None, (said, f"{head}\n{show_message(outcome.outputs)}")))


def say_progress(run: SkillRun) -> str:
    """Return a line that tells a waiting client how a run stands."""
    return f"{run.handle} {run.state}, {say_count(run.n_progress, 'sign')} of progress"
