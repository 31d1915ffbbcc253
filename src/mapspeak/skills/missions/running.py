"""A mission run: its tree ticked by py_trees whenever a step has ended, its leaves as tasks."""

from collections.abc import Callable, Coroutine, Mapping
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
    JsonValue,
    OnProgress,
    SkillCode,
    SkillOutcome,
    SkillProgress,
    SkillState,
)
from mapspeak.skills.facts import Facts, Stopwatch
from mapspeak.skills.missions.tree import (
    FindSkill,
    MissionCourse,
    Step,
    StepKind,
    fill_in,
    fit_kinds,
)

MOST_TOLD = 40
"""Steps of the account that are told; the record on disk has all."""
MOST_LINE = 300
OnStep = Callable[[str], None]


class MissionRunner:
    """Runs one mission once.

    Args:
        course: With a tree that was checked before, and no step begun.
        find_skill: Asked when a leaf begins: a skill may have gone meanwhile.
        facts: Tell the time.
        on_progress: Told of each step.
        on_step: Writes the record; it may not raise.

    Attributes:
        account: The steps done so far.
        ending: Steps that were cut off, and have not ended at the robot yet.
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
        self.values: dict[str, JsonValue] = dict(course.given)
        self.facts = facts
        self.account: list[str] = []
        self._find_skill = find_skill
        self._on_progress = on_progress
        self._on_step = on_step
        self._news = anyio.Event()
        self._tasks: TaskGroup | None = None
        self.ending: set[_Task] = set()
        self._cut_off: SkillOutcome | None = None
        self._last: SkillOutcome | None = None
        self._course = course
        self._given = [step.output for step in course.plan.tree.walk() if step.output]
        self._root = self._build(course.plan.tree)

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
        outputs = {name: self.values[name] for name in self._given if name in self.values}
        if self._cut_off is not None:
            return self._cut_off
        if self._root.status is Status.SUCCESS:
            return SkillOutcome(state=SkillState.SUCCEEDED, outputs=outputs)
        last = self._last
        return SkillOutcome(
            state=SkillState.FAILED,
            code=SkillCode.NOT_ACHIEVED if last is None else last.code,
            outputs=outputs,
            quote="" if last is None else last.quote,
        )

    # --- calls by leaves ---

    def start(self, work: Callable[[], Coroutine[object, object, None]]) -> None:
        """Run the work of a step beside the others."""
        if self._tasks is not None:
            self._tasks.start_soon(work)

    def wake(self) -> None:
        """Have the tree looked at again."""
        self._news.set()

    async def do_leaf(self, step: Step) -> SkillOutcome:
        """Run the skill of a leaf, once steps that were cut off before have ended."""
        while self.ending:
            await self._news.wait()
        self._course.states[step.number] = SkillState.RUNNING
        try:
            skill = self._find_skill(step.skill)
            given = fill_in(step.name_arguments(skill.spec), self.values)
            given = fit_kinds(skill.spec.parameters, given)
            self._tell(now=f"{step.number} {step.skill}")
            outcome = await skill.run(given, partial(self._take_progress, step))
        except anyio.get_cancelled_exc_class():
            self._course.states[step.number] = SkillState.CANCELLED
            self._note(f"{step.number} {step.skill}: cut off")
            raise
        except MapspeakError as error:
            outcome = SkillOutcome(
                state=SkillState.FAILED, code=SkillCode.REJECTED, quote=error.message
            )
        self._take_outcome(step, outcome)
        return outcome

    def _take_outcome(self, step: Step, outcome: SkillOutcome) -> None:
        self._course.states[step.number] = outcome.state
        if step.output:
            self.values[step.output] = {**outcome.outputs, "ended": str(outcome.state)}
        if outcome.state is not SkillState.SUCCEEDED:
            self._last = outcome
        if outcome.state is SkillState.CANCELLED:
            # A person, another client or the robot's own software has taken over.
            self._cut_off = outcome
        said = f"{step.number} {step.skill}: {outcome.state}"
        if outcome.code is not SkillCode.DONE:
            said += f" ({outcome.code})"
        if outcome.outputs:
            told = (f"{name}={str(each)[:60]}" for name, each in outcome.outputs.items())
            said += f" {', '.join(told)}"
        if outcome.quote:
            said += f' "{outcome.quote[:120]}"'
        self._note(said[:MOST_LINE])

    def _note(self, said: str) -> None:
        self.account.append(said)
        self._on_step(said)
        self._tell(now="")

    def _take_progress(self, step: Step, progress: SkillProgress) -> None:
        inner = progress.account
        now = f"{step.number} {step.skill}" + (f" [{inner[-1]}]" if inner else "")
        self._tell(now=now, is_asking=progress.is_asking, values=progress.values)

    def _tell(
        self, *, now: str, is_asking: bool = False, values: Mapping[str, JsonValue] | None = None
    ) -> None:
        told = tuple(self.account[-MOST_TOLD:]) + ((f"now: {now}",) if now else ())
        self._on_progress(SkillProgress(values=values or {}, is_asking=is_asking, account=told))

    # --- the tree ---

    def _build(self, step: Step) -> Behaviour:
        name = f"{step.number} {step.skill or step.kind}"
        if step.kind is StepKind.LEAF:
            return _Leaf(name, step, self)
        parts = [self._build(each) for each in step.steps]
        node: Behaviour
        match step.kind:
            case StepKind.SEQUENCE:
                node = Sequence(name, memory=True, children=parts)
            case StepKind.FALLBACK:
                node = Selector(name, memory=True, children=parts)
            case StepKind.PARALLEL:
                every, any_one = ParallelPolicy.SuccessOnAll, ParallelPolicy.SuccessOnOne
                node = Parallel(name, every() if step.needs_all else any_one(), children=parts)
            case StepKind.RETRY:
                node = Retry(name, parts[0], step.times)
            case StepKind.REPEAT:
                node = Repeat(name, parts[0], step.times)
            case StepKind.TIMEOUT:
                node = _TimeLimit(name, parts[0], step.limit, self)
            case StepKind.EVERY:
                paced = [_Pace(name, step.limit * 60, self), _whatever_comes(parts[0])]
                node = Repeat(name, Sequence(name, memory=True, children=paced), step.times)
            case StepKind.UNTIL:
                tried = [_whatever_comes(parts[0]), parts[1]]
                node = Retry(name, Sequence(name, memory=True, children=tried), step.times)
        return node


def _whatever_comes(inner: Behaviour) -> Behaviour:
    return FailureIsSuccess(f"{inner.name} in any case", inner)


class _Task:
    """Work that a node of the tree has begun, and may cut off."""

    def __init__(self, runner: MissionRunner) -> None:
        self.runner = runner
        self.is_over = False
        self.outcome: SkillOutcome | None = None
        self._scope = anyio.CancelScope()
        self._has_begun = False

    def cut_off(self) -> None:
        """End it, where it has begun and not ended."""
        if self._has_begun and not self.is_over:
            self.runner.ending.add(self)
        self._scope.cancel()

    async def do_leaf(self, step: Step) -> None:
        """Run the skill of a leaf."""
        self._has_begun = True
        with self._scope:
            self.outcome = await self.runner.do_leaf(step)
        self._end()

    async def sleep(self, duration_s: float) -> None:
        """Let robot time pass."""
        with self._scope:
            await self.runner.facts.sleep(max(duration_s, 0.0))
        self._end()

    async def watch(self, duration_s: float) -> None:
        """Wait for time that passes anyway."""
        with self._scope:
            await Stopwatch(self.runner.facts).wait(duration_s)
        self._end()

    def _end(self) -> None:
        self.is_over = True
        self.runner.ending.discard(self)
        self.runner.wake()


class _Leaf(Behaviour):
    """Runs a skill while it is ticked."""

    def __init__(self, name: str, step: Step, runner: MissionRunner) -> None:
        super().__init__(name)
        self._step = step
        self._runner = runner
        self._task = _Task(runner)

    def initialise(self) -> None:
        self._task = _Task(self._runner)
        self._runner.start(partial(self._task.do_leaf, self._step))

    def update(self) -> Status:
        outcome = self._task.outcome
        if outcome is None:
            return Status.RUNNING
        return Status.SUCCESS if outcome.state is SkillState.SUCCEEDED else Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        if new_status is Status.INVALID:
            self._task.cut_off()
        else:
            # A repeated step begins anew at the next tick.
            self._runner.wake()


class _Pace(Behaviour):
    """Succeeds at once the first time, then a period after it began before."""

    def __init__(self, name: str, period_s: float, runner: MissionRunner) -> None:
        super().__init__(name)
        self._period_s = period_s
        self._runner = runner
        self._begun_s: float | None = None
        self._task = _Task(runner)

    def initialise(self) -> None:
        now_s = self._runner.facts.now_s
        left_s = 0.0 if self._begun_s is None else self._begun_s + self._period_s - now_s
        self._begun_s = now_s + max(left_s, 0.0)
        self._task = _Task(self._runner)
        self._runner.start(partial(self._task.sleep, left_s))

    def update(self) -> Status:
        return Status.SUCCESS if self._task.is_over else Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        if new_status is Status.INVALID:
            self._task.cut_off()


class _TimeLimit(Decorator):
    """Fails when its step has not ended in time, by the robot's clock."""

    def __init__(
        self,
        name: str,
        child: Behaviour,
        limit_s: float,
        runner: MissionRunner,
    ) -> None:
        super().__init__(name, child)
        self._limit_s = limit_s
        self._runner = runner
        self._task = _Task(runner)

    def initialise(self) -> None:
        self._task = _Task(self._runner)
        self._runner.start(partial(self._task.watch, self._limit_s))

    def update(self) -> Status:
        inner = self.decorated.status
        return Status.FAILURE if inner is Status.RUNNING and self._task.is_over else inner

    def terminate(self, new_status: Status) -> None:
        del new_status
        self._task.cut_off()
