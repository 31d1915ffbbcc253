"""One mission run once, as a tree of py_trees that is ticked whenever work beside it has ended."""

import math
from collections.abc import Awaitable, Callable
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
    OnProgress,
    Skill,
    SkillCode,
    SkillOutcome,
    SkillProgress,
    SkillState,
)
from mapspeak.skills.guarding import Facts, wait
from mapspeak.skills.steps import Mission, Step, StepKind, fill_in

MOST_TOLD = 40
"""Steps of the account that are told; the record on disk has all."""
MOST_LINE = 300
ALL, ONE = ParallelPolicy.SuccessOnAll, ParallelPolicy.SuccessOnOne
Work = Callable[[], Awaitable[bool]]


@dataclass(eq=False)
class MissionRunner:
    """Runs one mission once.

    Attributes:
        mission: With a tree that was checked before.
        find_skill: Finds the skill of a leaf when that begins: it may have gone meanwhile.
        keep: Keeps what was done.
        states: Of the leaves that have begun, by their numbers.
        ending: What was cut off and has not ended yet; nothing new begins before.
    """

    mission: Mission
    given: Arguments
    facts: Facts
    find_skill: Callable[[str], Skill]
    keep: Callable[[str], None]
    on_progress: OnProgress
    states: dict[int, SkillState] = field(default_factory=dict)
    is_over: bool = False
    tasks: TaskGroup | None = None
    ending: set[anyio.CancelScope] = field(default_factory=set)
    news: anyio.Event = field(default_factory=anyio.Event)
    _account: list[str] = field(default_factory=list)
    _last: SkillOutcome = field(default_factory=partial(SkillOutcome, SkillCode.NOT_ACHIEVED))
    _is_cut_off: bool = False

    def __post_init__(self) -> None:
        # py_trees prints its messages, and stdout belongs to the protocol.
        py_trees.logging.level = py_trees.logging.Level.ERROR
        self._values = dict(self.given)
        self._root = self._build(self.mission.tree)

    async def run(self) -> SkillOutcome:
        """Run it to its end; cancelling this call cancels its running steps, too."""
        async with anyio.create_task_group() as self.tasks:
            while not self._is_cut_off:
                self.news = anyio.Event()
                self._root.tick_once()
                if self._root.status is not Status.RUNNING:
                    break
                await self.news.wait()
            self.tasks.cancel_scope.cancel()
        last, names = self._last, (step.output for step in self.mission.tree.walk())
        outputs = {name: self._values[name] for name in names if name in self._values}
        if self._is_cut_off:
            return last
        if self._root.status is Status.SUCCESS:
            return SkillOutcome(outputs=outputs)
        code = last.code if last.state is SkillState.FAILED else SkillCode.NOT_ACHIEVED
        return SkillOutcome(code, outputs=outputs, quote=last.quote)

    async def _do_leaf(self, step: Step) -> bool:
        self.states[step.number] = SkillState.RUNNING
        try:
            skill = self.find_skill(step.skill)
            given = fill_in(step.name_arguments(skill.spec), self._values)
            self._tell(now=f"{step.number} {step.skill}")
            outcome = await skill.run(given, partial(self._take_progress, step))
        except anyio.get_cancelled_exc_class():
            self.states[step.number] = SkillState.CANCELLED
            self._note(f"{step.number} {step.skill}: cut off")
            raise
        except MapspeakError as error:
            outcome = SkillOutcome(SkillCode.REJECTED, quote=error.message)
        self.states[step.number] = outcome.state
        if step.output:
            self._values[step.output] = {**outcome.outputs, "ended": str(outcome.state)}
        self._note(_say_end(step, outcome))
        if outcome.state is SkillState.SUCCEEDED:
            return True
        if not self._is_cut_off:
            # A person, another client or the robot's own software may have taken over.
            self._last, self._is_cut_off = outcome, outcome.state is SkillState.CANCELLED
        return False

    def _note(self, said: str) -> None:
        """Tell and keep what was done, with the time by the operator's clock, else the robot's."""
        at = self.facts.read_calendar()
        time = f"{self.facts.now_s:.0f} s" if at is None else f"{at:%H:%M:%S}"
        self._account.append(f"{time} {said}")
        self.keep(said)
        self._tell()

    def _take_progress(self, step: Step, progress: SkillProgress) -> None:
        inner = f" [{progress.account[-1]}]" if progress.account else ""
        self._tell(now=f"{step.number} {step.skill}{inner}", values=progress.values)

    def _tell(self, *, now: str = "", values: Arguments | None = None) -> None:
        told = (*self._account[-MOST_TOLD:], *([f"now: {now}"] if now else []))
        self.on_progress(SkillProgress(values=values or {}, account=told))

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
                node = _Rounds(name, once, step.times, self._note)
            case StepKind.UNTIL:
                in_any_case = FailureIsSuccess(name, parts[0])
                once = Sequence(name, memory=True, children=[in_any_case, parts[1]])
                node = Retry(name, once, step.times)
        return node

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


def _say_end(step: Step, outcome: SkillOutcome) -> str:
    code = "" if outcome.code is SkillCode.DONE else f" ({outcome.code})"
    told = (f"{name}={str(each)[:60]}" for name, each in outcome.outputs.items() if each != "")
    said = f"{step.number} {step.skill}: {outcome.state}{code} {', '.join(told)}".rstrip()
    return (said + (f' "{outcome.quote[:120]}"' if outcome.quote else ""))[:MOST_LINE]


class _Rounds(Decorator):
    """Several rounds, which all take place; they fail where none has succeeded."""

    def __init__(self, name: str, child: Behaviour, n: int, note: Callable[[str], None]) -> None:
        super().__init__(name, child)
        self._n_rounds, self._note = n, note
        self._n_done = self._n_good = 0

    def initialise(self) -> None:
        self._n_done = self._n_good = 0

    def update(self) -> Status:
        if (status := self.decorated.status) is Status.RUNNING:
            return status
        self._n_done += 1
        self._n_good += status is Status.SUCCESS
        if self._n_done < self._n_rounds:
            return Status.RUNNING
        self._note(f"{self.name}: {self._n_good} of {self._n_rounds} rounds did all their steps")
        return Status.SUCCESS if self._n_good else Status.FAILURE


class _Work(Behaviour):
    """Ends as some work beside the tree does; it begins anew whenever it is ticked anew."""

    def __init__(self, name: str, work: Work, runner: MissionRunner) -> None:
        super().__init__(name)
        self._work, self._runner = work, runner
        self._scope, self._ended = anyio.CancelScope(), Status.INVALID

    def initialise(self) -> None:
        self._scope, self._ended = anyio.CancelScope(), Status.RUNNING
        if self._runner.tasks is not None:
            self._runner.tasks.start_soon(self._do, self._scope)

    async def _do(self, scope: anyio.CancelScope) -> None:
        with scope:
            while self._runner.ending:
                await self._runner.news.wait()
            is_done = await self._work()
            if not scope.cancel_called:
                self._ended = Status.SUCCESS if is_done else Status.FAILURE
        self._runner.ending.discard(scope)
        self._runner.news.set()

    def update(self) -> Status:
        return self._ended

    def terminate(self, new_status: Status) -> None:
        if new_status is not Status.INVALID:
            # A repeated step begins anew at the next tick.
            self._runner.news.set()
        elif self._ended is Status.RUNNING:
            self._ended = Status.INVALID
            self._runner.ending.add(self._scope)
            self._scope.cancel()
