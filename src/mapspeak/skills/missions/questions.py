"""Questions that missions ask a model or a person, with a default when the time is over."""

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field

import anyio

from mapspeak.errors import SkillError
from mapspeak.skill import (
    JsonValue,
    OnProgress,
    ParameterKind,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillParameter,
    SkillProgress,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.facts import Facts, Stopwatch

MOST_WAIT_S = 86_400.0
ASK = SkillSpec(
    name="ask",
    description="Asks whoever talks to the robot, and waits for the answer",
    effect=SkillEffect.READS,
    timeout_s=MOST_WAIT_S,
    parameters=(
        SkillParameter(name="question", kind=ParameterKind.TEXT, most=300, is_required=True),
        SkillParameter(
            name="answers",
            kind=ParameterKind.LIST,
            description="those that are taken; any where left out",
            least=2,
            most=10,
            item=SkillParameter(name="", kind=ParameterKind.TEXT, most=80),
        ),
        SkillParameter(
            name="otherwise",
            kind=ParameterKind.TEXT,
            description="the answer when nobody gives one; the step fails without",
            most=300,
        ),
        SkillParameter(
            name="within_s",
            kind=ParameterKind.NUMBER,
            unit="s",
            least=1,
            most=MOST_WAIT_S,
            default=300.0,
        ),
        SkillParameter(
            name="picture",
            kind=ParameterKind.TEXT,
            description="the id of the picture to ask about; the latest where left out",
            most=40,
        ),
    ),
)


MOST_PICTURES = 12


@dataclass(frozen=True, slots=True)
class AskedPicture:
    """A picture that questions may be about.

    Attributes:
        format: Such as "jpeg".
    """

    id: str
    data: bytes
    format: str


@dataclass(eq=False)
class Question:
    """A question that waits.

    Attributes:
        id: Such as "Q1".
        picture: Its subject; None where the mission has taken none.
        answer: None until one is given.
    """

    id: str
    text: str
    answers: tuple[str, ...]
    picture: AskedPicture | None
    answer: str | None = None
    is_answered: anyio.Event = field(default_factory=anyio.Event)


class QuestionBook:
    """The questions that wait, the oldest first."""

    def __init__(self) -> None:
        self.waiting: list[Question] = []
        self._n_asked = 0
        self._pictures: OrderedDict[str, AskedPicture] = OrderedDict()

    def keep(self, picture: AskedPicture) -> None:
        """Keep a picture that a mission has taken."""
        self._pictures[picture.id] = picture
        while len(self._pictures) > MOST_PICTURES:
            self._pictures.popitem(last=False)

    def put(self, text: str, answers: tuple[str, ...], picture: str | None) -> Question:
        """Let a question wait, about a picture or the latest."""
        self._n_asked += 1
        latest = next(reversed(self._pictures.values()), None)
        shown = latest if picture is None else self._pictures.get(picture)
        question = Question(f"Q{self._n_asked}", text, answers, shown)
        self.waiting.append(question)
        return question

    def find(self, question_id: str | None) -> Question:
        """Return a question that waits; the oldest unless one is named.

        Raises:
            SkillError: None waits, or not that one.
        """
        for each in self.waiting:
            if question_id is None or each.id == question_id.strip().upper():
                return each
        ids = ", ".join(each.id for each in self.waiting)
        raise SkillError(
            "No mission waits for an answer." if not ids else f"No question {question_id!r} waits.",
            hint=f"There wait: {ids}." if ids else "Nothing was answered.",
        )

    def answer(self, question: Question, answer: str) -> str:
        """Give an answer, and return it as the mission takes it.

        Raises:
            SkillError: It is not one of the accepted answers.
        """
        taken = {each.casefold(): each for each in question.answers}
        said = answer.strip()
        if taken and said.casefold() not in taken:
            raise SkillError(
                f"{question.id} cannot be answered by {said[:60]!r}.",
                hint=f"Give one of: {', '.join(question.answers)}.",
            )
        question.answer = taken.get(said.casefold(), said)
        question.is_answered.set()
        return question.answer


class AskSkill:
    """Waits for an answer."""

    spec = ASK

    def __init__(self, questions: QuestionBook, facts: Facts) -> None:
        self._questions = questions
        self._facts = facts

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Ask, and fall back on the default where no answer comes in time."""
        question = self._questions.put(
            arguments["question"], tuple(arguments.get("answers", ())), arguments.get("picture")
        )
        on_progress(SkillProgress(is_asking=True))
        try:
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(self._end_of_patience, question, arguments["within_s"])
                await question.is_answered.wait()
                tasks.cancel_scope.cancel()
        finally:
            self._questions.waiting.remove(question)
            on_progress(SkillProgress())
        if question.answer is not None:
            return _succeed(question.answer, by="answered")
        otherwise = arguments.get("otherwise")
        if otherwise is None:
            return SkillOutcome(state=SkillState.FAILED, code=SkillCode.NOT_ANSWERED)
        return _succeed(otherwise, by="nobody")

    async def _end_of_patience(self, question: Question, within_s: float) -> None:
        await Stopwatch(self._facts).wait(within_s)
        question.is_answered.set()


def _succeed(answer: str, *, by: str) -> SkillOutcome:
    return SkillOutcome(state=SkillState.SUCCEEDED, outputs={"answer": answer, "by": by})
