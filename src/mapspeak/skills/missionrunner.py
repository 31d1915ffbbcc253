"""A mission run: its tree ticked by py_trees whenever a step has ended, its steps as tasks."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import anyio
import py_trees
from anyio.abc import TaskGroup
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import FailureIsSuccess, Repeat, Retry

from mapspeak.errors import MapspeakError
from mapspeak.skill import (
    JsonValue,
    OnProgress,
    SkillCode,
    SkillOutcome,
    SkillProgress,
    SkillState,
    failed,
)
from mapspeak.skills.guarding import Facts, wait
from mapspeak.skills.mission import FindSkill, MissionCourse
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


class MissionRunner:
    """Runs one mission once.

    Args:
        course: With a tree that was checked before, and no step begun.
        find_skill: Asked when a leaf begins: a skill may have gone meanwhile.
        facts: Tell the time.
        on_progress: Told of each step.
        on_step: Writes the record; it may not raise.
    """

    def __init__(
        self,
        course: MissionCourse,
        *,
        find_skill: FindSkill,
        facts: Facts,
        on_progress: OnProgress,
        on_step: OnStep,
    ) -> None:
        # py_trees prints its messages, and stdout belongs to the protocol.
        py_trees.logging.level = py_trees.logging.Level.ERROR
        self._values: dict[str, JsonValue] = dict(course.given)
        self._facts = facts
        self._account: list[str] = []
        self._find_skill = find_skill
        self._on_progress = on_progress
        self._on_step = on_step
        self._news = anyio.Event()
        self._tasks: TaskGroup | None = None
        self._ending: set[_Job] = set()
        self._cut_off: SkillOutcome | None = None
        self._last: SkillOutcome = failed()
        self._states = course.states
        tree = course.mission.tree
        self._given = [step.output for step in tree.walk() if step.output]
        self._root = self._build(tree)

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
        outputs = {name: self._values[name] for name in self._given if name in self._values}
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
        self._states[step.number] = SkillState.RUNNING
        try:
            skill = self._find_skill(step.skill)
            given = fill_in(step.name_arguments(skill.spec), self._values)
            self._tell(now=f"{step.number} {step.skill}")
            outcome = await skill.run(given, partial(self._take_progress, step))
        except anyio.get_cancelled_exc_class():
            self._states[step.number] = SkillState.CANCELLED
            self._note(f"{step.number} {step.skill}: cut off")
            raise
        except MapspeakError as error:
            outcome = failed(SkillCode.REJECTED, error.message)
        self._states[step.number] = outcome.state
        if step.output:
            self._values[step.output] = {**outcome.outputs, "ended": str(outcome.state)}
        self._note(_say_end(step, outcome))
        if outcome.state is SkillState.SUCCEEDED:
            return True
        self._last = outcome
        if outcome.state is SkillState.CANCELLED:
            # A person, another client or the robot's own software has taken over.
            self._cut_off = outcome
        return False

    async def _expire(self, limit_s: float) -> bool:
        await wait(self._facts, limit_s)
        return False

    # --- what is told ---

    def _note(self, said: str) -> None:
        self._account.append(said)
        self._on_step(said)
        self._tell(now="")

    def _take_progress(self, step: Step, progress: SkillProgress) -> None:
        inner = progress.account
        now = f"{step.number} {step.skill}" + (f" [{inner[-1]}]" if inner else "")
        self._tell(now=now, is_asking=progress.is_asking, values=progress.values)

    def _tell(
        self, *, now: str, is_asking: bool = False, values: Mapping[str, JsonValue] | None = None
    ) -> None:
        told = tuple(self._account[-MOST_TOLD:]) + ((f"now: {now}",) if now else ())
        self._on_progress(SkillProgress(values=values or {}, is_asking=is_asking, account=told))

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
                pacing = _Work(name, _Pace(step.limit * 60, self._facts).keep, self)
                once = Sequence(name, memory=True, children=[pacing, _whatever(parts[0])])
                node = Repeat(name, once, step.times)
            case StepKind.UNTIL:
                once = Sequence(name, memory=True, children=[_whatever(parts[0]), parts[1]])
                node = Retry(name, once, step.times)
        return node


def _whatever(inner: Behaviour) -> Behaviour:
    return FailureIsSuccess(f"{inner.name} in any case", inner)


def _say_end(step: Step, outcome: SkillOutcome) -> str:
    said = f"{step.number} {step.skill}: {outcome.state}"
    if outcome.code is not SkillCode.DONE:
        said += f" ({outcome.code})"
    told = (f"{name}={str(each)[:60]}" for name, each in outcome.outputs.items() if each != "")
    said = f"{said} {', '.join(told)}".rstrip()
    if outcome.quote:
        said += f' "{outcome.quote[:120]}"'
    return said[:MOST_LINE]


@dataclass
class _Pace:
    """Lets a period pass between two beginnings; the first comes at once."""

    period_s: float
    facts: Facts
    next_s: float | None = None

    async def keep(self) -> bool:
        """Wait for the next beginning."""
        now_s = self.facts.now_s
        begin_s = now_s if self.next_s is None else max(now_s, self.next_s)
        self.next_s = begin_s + self.period_s
        await self.facts.sleep(begin_s - now_s)
        return True


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
