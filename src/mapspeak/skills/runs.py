"""Runs of skills in the background, and the questions that they ask meanwhile."""

import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import partial

import anyio
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError, MapspeakError, SkillError
from mapspeak.robot import CameraPicture
from mapspeak.safety import current_caller
from mapspeak.skill import (
    Arguments,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillProgress,
    SkillState,
)
from mapspeak.skills.steps import Mission

MOST_PICTURES = 40
MOST_KEPT = 200
MOST_AT_ONCE = 20
BEGINS_S = 2.0
"""Wall time in which a run that cannot begin fails; before it no run is reported as going on."""
LOOK_S = 0.05
"""Wall time between two looks for a stop."""
logger = logging.getLogger(__name__)


@dataclass(eq=False, kw_only=True)
class Question:
    """A question that waits.

    Attributes:
        given: The arguments of the leaf that asks it, with the latest picture where it names none.
        client: The session that may answer it, as long as it is there; empty for anyone.
    """

    id: str
    given: Arguments
    client: str
    picture: CameraPicture | None
    answer: str | None = None
    is_answered: anyio.Event = field(default_factory=anyio.Event)


@dataclass(eq=False)
class QuestionBook:
    """The questions of missions, by their ids.

    Attributes:
        pictures: What they are about, by their ids.
        waiting: Those that no answer was given to, the oldest first.
        gone: The clients whose questions anyone may answer: their missions go on without them.
    """

    pictures: dict[str, CameraPicture] = field(default_factory=dict)
    waiting: dict[str, Question] = field(default_factory=dict)
    gone: set[str] = field(default_factory=set)
    _n_asked: int = 0

    def keep(self, picture_id: str, picture: CameraPicture) -> None:
        """Keep a picture that a mission has taken."""
        self.pictures[picture_id] = picture
        for oldest in list(self.pictures)[:-MOST_PICTURES]:
            del self.pictures[oldest]

    def put(self, given: Arguments, *, client: str) -> Question:
        """Return the question of a leaf, which waits from now on."""
        self._n_asked += 1
        given = {"picture": next(reversed(self.pictures), ""), **given}
        question = Question(
            id=f"Q{self._n_asked}",
            given=given,
            client=client,
            picture=self.pictures.get(given["picture"]),
        )
        self.waiting[question.id] = question
        return question

    def find(self, question_id: str | None, *, client: str | None) -> Question:
        """Return a question that waits for the session of a client; the oldest unless one is named.

        A person, whose client is None, may answer every one. SkillError where none waits.
        """
        asked, open_to = self.waiting.values(), {"", client, *self.gone}
        mine = {each.id: each for each in asked if client is None or each.client in open_to}
        if not mine and self.waiting:
            hint = "Only the client that runs the mission answers it."
            raise SkillError("No mission waits for an answer of yours.", hint=hint)
        if not mine:
            raise SkillError("No mission waits.", hint="Nothing was answered.")
        wanted = next(iter(mine)) if question_id is None else question_id.strip().upper()
        if wanted not in mine:
            hint = f"There wait: {', '.join(mine)}."
            raise SkillError(f"No question {question_id!r} waits.", hint=hint)
        return mine[wanted]

    def answer(self, question: Question, answer: str) -> str:
        """Give an answer, and return it as it is taken; SkillError where it is not."""
        answers = question.given.get("answers", ())
        taken = {each.casefold(): each for each in answers}
        said = answer.strip()
        if taken and said.casefold() not in taken:
            raise SkillError(
                f"{question.id} cannot be answered by {said[:60]!r}.",
                hint=f"Give one of: {', '.join(answers)}.",
            )
        question.answer = taken.get(said.casefold(), said)
        self.waiting.pop(question.id, None)
        question.is_answered.set()
        return question.answer


OnNews = Callable[["SkillRun"], Awaitable[None]]


@dataclass(eq=False, kw_only=True)
class SkillRun:
    """One run of a skill, as far as it has come; kept after its end.

    Attributes:
        client: It ends when that client is gone; None for a mission, which goes on.
        outcome: None while it goes on, and where it could not be begun.
        error: Why it could not be begun.
    """

    handle: str
    skill: Skill
    client: str | None
    runs: "SkillRuns"
    progress: SkillProgress = field(default_factory=SkillProgress)
    n_progress: int = 0
    outcome: SkillOutcome | None = None
    error: MapspeakError | None = None
    _ended_s: float | None = None
    _scope: anyio.CancelScope = field(default_factory=anyio.CancelScope)
    _news: anyio.Event = field(default_factory=anyio.Event)
    _why: SkillCode = SkillCode.CANCELLED

    def __post_init__(self) -> None:
        self._begun_s, self.n_stops = self.runs.read_clock_s(), self.runs.count_stops()

    @property
    def is_over(self) -> bool:
        """True when nothing more will happen."""
        return self._ended_s is not None

    @property
    def state(self) -> SkillState:
        """Its state."""
        if self.outcome is not None:
            return self.outcome.state
        return SkillState.RUNNING if self.error is None else SkillState.FAILED

    @property
    def is_asking(self) -> bool:
        """True while it waits for an answer; missions alone ask, one at a time."""
        asks = isinstance(self.skill, Mission) and bool(self.runs.questions.waiting)
        return asks and not self.is_over

    @property
    def passed_s(self) -> float:
        """How long it has taken, or took, in robot time."""
        now_s = self.runs.read_clock_s() if self._ended_s is None else self._ended_s
        return max(now_s - self._begun_s, 0.0)

    async def do(self, arguments: Arguments) -> None:
        """Run the skill, and keep its outcome or error."""
        try:
            with self._scope:
                self.outcome = await self.skill.run(arguments, self._take_progress)
            if self.outcome is None:
                self.outcome = SkillOutcome(self._why)
        except MapspeakError as error:
            self.error = error
        except Exception:
            # One faulty skill must not end all that goes on beside it.
            logger.exception("The skill %s failed by a mistake in it", self.skill.spec.name)
            self.outcome = SkillOutcome(SkillCode.LOST)
        finally:
            self._ended_s = self.runs.read_clock_s()
            self._tell()

    async def wait(self, *, wait_s: float, on_news: OnNews | None = None) -> None:
        """Return at its end, at a question, or after some wall time; report progress meanwhile."""
        with anyio.move_on_after(wait_s):
            while not self.is_over and not self.is_asking:
                news, n_before = self._news, self.n_progress
                await news.wait()
                if on_news is not None and self.n_progress != n_before:
                    await on_news(self)

    async def cancel(self) -> None:
        """End it, and return when it has ended: nothing of it is left at the robot then."""
        self.give_up(SkillCode.CANCELLED)
        while not self.is_over:
            await self._news.wait()

    def give_up(self, why: SkillCode) -> None:
        """Have it end."""
        self._why = why
        self._scope.cancel()

    def _take_progress(self, progress: SkillProgress) -> None:
        self.progress = progress
        self.n_progress += 1
        self._tell()

    def _tell(self) -> None:
        news, self._news = self._news, anyio.Event()
        news.set()


@dataclass(eq=False)
class SkillRuns:
    """All runs of one server, the latest last; they go on while `keep_going` runs.

    Attributes:
        count_stops: Changes at each stop of the robot, which ends all runs that do more than read.
    """

    count_stops: Callable[[], int] = lambda: 0
    read_clock_s: Callable[[], float] = anyio.current_time
    questions: QuestionBook = field(default_factory=QuestionBook)
    _runs: dict[str, SkillRun] = field(default_factory=dict)
    _n_begun: int = 0
    _tasks: TaskGroup | None = None

    @property
    def under_way(self) -> list[SkillRun]:
        """The runs that have not ended."""
        return [run for run in self._runs.values() if not run.is_over]

    async def keep_going(self, work: Callable[[], Awaitable[None]]) -> None:
        """Let runs go on in the background while some work is done; they end with it."""
        async with anyio.create_task_group() as tasks:
            self._tasks = tasks
            tasks.start_soon(self._obey_stops)
            try:
                await work()
            finally:
                self._tasks = None
                tasks.cancel_scope.cancel()

    async def _obey_stops(self) -> None:
        while True:
            await anyio.sleep(LOOK_S)
            for run in self.under_way:
                does = run.skill.spec.effect is not SkillEffect.READS
                if does and run.n_stops != self.count_stops():
                    run.give_up(SkillCode.STOPPED)

    async def begin(
        self, skill: Skill, arguments: Arguments, *, wait_s: float, on_news: OnNews | None = None
    ) -> SkillRun:
        """Run a skill, and return when it has ended, or when the time is over while it goes on.

        Cancelling this call gives up the run. MapspeakError where it could not begin.
        """
        if self._tasks is None:
            raise LinkError("No skill can be run: the server is ending.", hint="Start it again.")
        if len(self.under_way) >= MOST_AT_ONCE:
            raise SkillError(
                f"{MOST_AT_ONCE} skills are being run at once.", hint="Wait for one, or cancel it."
            )
        self._n_begun += 1
        client = None if isinstance(skill, Mission) else current_caller().session
        run = SkillRun(handle=f"S{self._n_begun}", skill=skill, client=client, runs=self)
        over = [each.handle for each in self._runs.values() if each.is_over]
        for old in over[: max(len(self._runs) + 1 - MOST_KEPT, 0)]:
            del self._runs[old]
        self._runs[run.handle] = run
        self._tasks.start_soon(partial(run.do, dict(arguments)))
        try:
            await run.wait(wait_s=max(wait_s, BEGINS_S), on_news=on_news)
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True):
                await run.cancel()
            raise
        if run.error is not None:
            self._runs.pop(run.handle, None)
            raise run.error
        return run

    def find(self, handle: str | None) -> SkillRun:
        """Return a run by its handle, the latest without one; SkillError where there is none."""
        key = next(reversed(self._runs), "") if handle is None else handle.strip().upper()
        if (run := self._runs.get(key)) is None:
            latest = ", ".join(list(self._runs)[-5:])
            raise SkillError(
                f"No run of a skill is called {handle[:40]!r}." if handle else "No skill was run.",
                hint=f"The latest are {latest}." if latest else "Run one first.",
            )
        return run

    async def client_is_gone(self, client: str) -> None:
        """End the runs of a client that has gone away; anyone may answer those that go on."""
        self.questions.gone.add(client)
        for run in self.under_way:
            if run.client == client:
                await run.cancel()
