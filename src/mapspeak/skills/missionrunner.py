"""A mission run: its tree ticked by py_trees whenever a step has ended, its steps as tasks."""

import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import anyio
import py_trees
from anyio.abc import TaskGroup
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import Decorator, FailureIsSuccess, Repeat, Retry

from mapspeak.errors import MapspeakError
from mapspeak.skill import (
    Arguments,
    JsonValue,
    OnProgress,
    SkillCode,
    SkillOutcome,
    SkillProgress,
    SkillState,
    failed,
)
from mapspeak.skills.guarding import Facts, wait
from mapspeak.skills.mission import FindSkill, Mission
from mapspeak.skills.steps import Step, StepKind, fill_in

MOST_TOLD = 40
"""Steps of the account that are told; the record on disk has all."""
MOST_LINE = 300
ALL, ONE = ParallelPolicy.SuccessOnAll, ParallelPolicy.SuccessOnOne
OnStep = Callable[[str], None]
Work = Callable[[], Awaitable[bool]]


@dataclass(eq=False)
class _Job:
    """Work that a node of the tree has begun, and may cut off."""

    scope: anyio.CancelScope = field(default_factory=anyio.CancelScope)
    status: Status = Status.RUNNING
    has_begun: bool = False


@dataclass(eq=False, kw_only=True)
class MissionRunner:
    """Runs one mission once.

    Attributes:
        mission: With a tree that was checked before.
        given: Its arguments.
        find_skill: Asked when a leaf begins: a skill may have gone meanwhile.
        facts: Tell the time.
        on_progress: Told of each step.
        on_step: Writes the record; it may not raise.
        states: Of the leaves that have begun, by their numbers.
    """

    mission: Mission
    given: Arguments
    find_skill: FindSkill
    facts: Facts
    on_progress: OnProgress
    on_step: OnStep
    states: dict[int, SkillState] = field(default_factory=dict)
    is_over: bool = False
    _account: list[str] = field(default_factory=list)
    _news: anyio.Event = field(default_factory=anyio.Event)
    _tasks: TaskGroup | None = None
    _ending: set[_Job] = field(default_factory=set)
    _cut_off: SkillOutcome | None = None
    _last: SkillOutcome = field(default_factory=failed)

    def __post_init__(self) -> None:
        # py_trees prints its messages, and stdout belongs to the protocol.
        py_trees.logging.level = py_trees.logging.Level.ERROR
        self._values: dict[str, JsonValue] = dict(self.given)
        self._root = self._build(self.mission.tree)

    async def run(self) -> SkillOutcome:
        """Run it to its end; cancelling this call cancels its running steps, too."""
        async with anyio.create_task_group() as self._tasks:
            while self._cut_off is None:
                self._news = anyio.Event()
                self._root.tick_once()
                if self._root.status is not Status.RUNNING:
                    break
                await self._news.wait()
            self._tasks.cancel_scope.cancel()
        if self._cut_off is not None:
            return self._cut_off
        given = (step.output for step in self.mission.tree.walk())
        outputs = {name: self._values[name] for name in given if name in self._values}
        if self._root.status is Status.SUCCESS:
            return SkillOutcome(SkillState.SUCCEEDED, outputs=outputs)
        last = self._last
        return SkillOutcome(SkillState.FAILED, last.code, outputs=outputs, quote=last.quote)

    # --- work beside the tree ---

    def start(self, work: Work) -> _Job:
        """Begin the work of a node, once all that was cut off before has ended."""
        job = _Job()
        if self._tasks is not None:
            self._tasks.start_soon(self._do, job, work)
        return job

    def cut_off(self, job: _Job) -> None:
        """Have work end, where it has begun and not ended."""
        if job.has_begun and job.status is Status.RUNNING:
            self._ending.add(job)
        job.scope.cancel()

    def wake(self) -> None:
        """Have the tree looked at again."""
        self._news.set()

    async def _do(self, job: _Job, work: Work) -> None:
        with job.scope:
            while self._ending:
                await self._news.wait()
            if job.scope.cancel_called:
                return
            job.has_begun = True
            job.status = Status.SUCCESS if await work() else Status.FAILURE
        self._ending.discard(job)
        self.wake()

    async def _do_leaf(self, step: Step) -> bool:
        self.states[step.number] = SkillState.RUNNING
        try:
            skill = self.find_skill(step.skill)
            given = fill_in(step.name_arguments(skill.spec), self._values)
            self._tell(now=f"{step.number} {step.skill}")
            outcome = await skill.run(given, partial(self._take_progress, step))
        except anyio.get_cancelled_exc_class():
            self.states[step.number] = SkillState.CANCELLED
            self.note(f"{step.number} {step.skill}: cut off")
            raise
        except MapspeakError as error:
            outcome = failed(SkillCode.REJECTED, error.message)
        self.states[step.number] = outcome.state
        if step.output:
            self._values[step.output] = {**outcome.outputs, "ended": str(outcome.state)}
        self.note(_say_end(step, outcome))
        if outcome.state is SkillState.SUCCEEDED:
            return True
        self._last = outcome
        if outcome.state is SkillState.CANCELLED:
            # A person, another client or the robot's own software has taken over.
            self._cut_off = outcome
        return False

    async def _expire(self, limit_s: float) -> bool:
        await wait(self.facts, limit_s)
        return False

    def _pace(self, period_s: float) -> Work:
        """Return work that lets a period pass between two beginnings; the first comes at once."""
        next_s = -math.inf

        async def keep() -> bool:
            nonlocal next_s
            now_s = self.facts.now_s
            begin_s = max(now_s, next_s)
            next_s = begin_s + period_s
            await self.facts.sleep(begin_s - now_s)
            return True

        return keep

    # --- what is told ---

    def note(self, said: str) -> None:
        """Tell and keep what was done, with the time by the operator's clock, else the robot's."""
        at = self.facts.read_calendar()
        time = f"{self.facts.now_s:.0f} s" if at is None else f"{at:%H:%M:%S}"
        self._account.append(f"{time} {said}")
        self.on_step(said)
        self._tell(now="")

    def _take_progress(self, step: Step, progress: SkillProgress) -> None:
        inner = progress.account
        now = f"{step.number} {step.skill}" + (f" [{inner[-1]}]" if inner else "")
        self._tell(now=now, is_asking=progress.is_asking, values=progress.values)

    def _tell(
        self, *, now: str, is_asking: bool = False, values: Mapping[str, JsonValue] | None = None
    ) -> None:
        told = tuple(self._account[-MOST_TOLD:]) + ((f"now: {now}",) if now else ())
        self.on_progress(SkillProgress(values=values or {}, is_asking=is_asking, account=told))

    # --- the tree ---

    def _build(self, step: Step) -> Behaviour:
        name = f"{step.number} {step.skill or step.kind}"
        parts = [self._build(each) for each in step.steps]
        node: Behaviour
        match step.kind:
            case StepKind.LEAF:
                node = _Work(name, partial(self._do_leaf, step), self)
            case StepKind.SEQUENCE:
                node = Sequence(name, memory=True, children=parts)
            case StepKind.FALLBACK:
                node = Selector(name, memory=True, children=parts)
            case StepKind.PARALLEL:
                node = Parallel(name, ALL() if step.needs_all else ONE(), children=parts)
            case StepKind.RETRY:
                node = Retry(name, parts[0], step.times)
            case StepKind.REPEAT:
                node = Repeat(name, parts[0], step.times)
            case StepKind.TIMEOUT:
                expiring = _Work(name, partial(self._expire, step.limit), self)
                node = Parallel(name, ONE(), children=[parts[0], expiring])
            case StepKind.EVERY:
                pacing = _Work(name, self._pace(step.limit * 60), self)
                once = Sequence(name, memory=True, children=[pacing, *parts])
                node = Repeat(name, _Round(name, once, step.times, self.note), step.times)
            case StepKind.UNTIL:
                in_any_case = FailureIsSuccess(name, parts[0])
                once = Sequence(name, memory=True, children=[in_any_case, parts[1]])
                node = Retry(name, once, step.times)
        return node


def _say_end(step: Step, outcome: SkillOutcome) -> str:
    said = f"{step.number} {step.skill}: {outcome.state}"
    if outcome.code is not SkillCode.DONE:
        said += f" ({outcome.code})"
    told = (f"{name}={str(each)[:60]}" for name, each in outcome.outputs.items() if each != "")
    said = f"{said} {', '.join(told)}".rstrip()
    if outcome.quote:
        said += f' "{outcome.quote[:120]}"'
    return said[:MOST_LINE]


class _Round(Decorator):
    """A round of several, which all take place; the last one fails where none has succeeded."""

    def __init__(
        self, name: str, child: Behaviour, n_rounds: int, note: Callable[[str], None]
    ) -> None:
        super().__init__(name, child)
        self._n_rounds, self._note = n_rounds, note
        self._n_done = self._n_good = 0

    def update(self) -> Status:
        if (status := self.decorated.status) is Status.RUNNING:
            return status
        self._n_done += 1
        self._n_good += status is Status.SUCCESS
        if self._n_done < self._n_rounds:
            return Status.SUCCESS
        n_good, self._n_done, self._n_good = self._n_good, 0, 0
        self._note(f"{self.name}: {n_good} of {self._n_rounds} rounds did all their steps")
        return Status.SUCCESS if n_good else Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        if new_status is Status.INVALID:
            self._n_done = self._n_good = 0


class _Work(Behaviour):
    """Ends as some work beside the tree does; it begins anew whenever it is ticked anew."""

    def __init__(self, name: str, work: Work, runner: MissionRunner) -> None:
        super().__init__(name)
        self._work = work
        self._runner = runner
        self._job = _Job()

    def initialise(self) -> None:
        self._job = self._runner.start(self._work)

    def update(self) -> Status:
        return self._job.status

    def terminate(self, new_status: Status) -> None:
        if new_status is Status.INVALID:
            self._runner.cut_off(self._job)
        else:
            # A repeated step begins anew at the next tick.
            self._runner.wake()
