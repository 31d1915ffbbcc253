"""The steps of a mission as a tree of py_trees, ticked whenever work beside it has ended."""

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

from mapspeak.skills.guarding import Facts, wait
from mapspeak.skills.steps import Step, StepKind

ALL, ONE = ParallelPolicy.SuccessOnAll, ParallelPolicy.SuccessOnOne
Work = Callable[[], Awaitable[bool]]


@dataclass(eq=False)
class _Job:
    """Work that a node of the tree has begun, and may cut off."""

    scope: anyio.CancelScope = field(default_factory=anyio.CancelScope)
    status: Status = Status.RUNNING
    has_begun: bool = False


class StepTree:
    """Does a tree of steps once.

    Args:
        do_leaf: Does a leaf, and returns whether it has succeeded.
        note: Told how many rounds of several succeeded.
    """

    def __init__(
        self,
        tree: Step,
        do_leaf: Callable[[Step], Awaitable[bool]],
        facts: Facts,
        note: Callable[[str], None],
    ) -> None:
        # py_trees prints its messages, and stdout belongs to the protocol.
        py_trees.logging.level = py_trees.logging.Level.ERROR
        self._do_leaf, self._facts, self._note = do_leaf, facts, note
        self._news = anyio.Event()
        self._tasks: TaskGroup | None = None
        self._ending: set[_Job] = set()
        self._root = self._build(tree)

    async def run(self) -> bool:
        """Return at its end whether it has succeeded; cancelling this cancels running leaves."""
        async with anyio.create_task_group() as self._tasks:
            while True:
                self._news = anyio.Event()
                self._root.tick_once()
                if self._root.status is not Status.RUNNING:
                    break
                await self._news.wait()
            self._tasks.cancel_scope.cancel()
        return self._root.status is Status.SUCCESS

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

    async def _expire(self, limit_s: float) -> bool:
        await wait(self._facts, limit_s)
        return False

    def _pace(self, period_s: float) -> Work:
        """Return work that lets a period pass between two beginnings; the first comes at once."""
        next_s = -math.inf

        async def keep() -> bool:
            nonlocal next_s
            now_s = self._facts.now_s
            begin_s = max(now_s, next_s)
            next_s = begin_s + period_s
            await self._facts.sleep(begin_s - now_s)
            return True

        return keep

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
                node = Repeat(name, _Round(name, once, step.times, self._note), step.times)
            case StepKind.UNTIL:
                in_any_case = FailureIsSuccess(name, parts[0])
                once = Sequence(name, memory=True, children=[in_any_case, parts[1]])
                node = Retry(name, once, step.times)
        return node


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

    def __init__(self, name: str, work: Work, tree: StepTree) -> None:
        super().__init__(name)
        self._work, self._tree, self._job = work, tree, _Job()

    def initialise(self) -> None:
        self._job = self._tree.start(self._work)

    def update(self) -> Status:
        return self._job.status

    def terminate(self, new_status: Status) -> None:
        if new_status is Status.INVALID:
            self._tree.cut_off(self._job)
        else:
            # A repeated step begins anew at the next tick.
            self._tree.wake()
