"""Sending, following and ending goals, the same for both versions of ROS."""

import logging
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from functools import partial

import anyio

from mapspeak.errors import GoalError, LinkError
from mapspeak.ros.activity import ActionGoal, ActionState, Subscription
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.port import RosConnection

NOT_TAKEN = "The action server gave no sign of taking the goal within {:g} s; it was withdrawn."
GIVEN_UP = "Its sender gave up waiting."
STOPPED = "The robot was stopped before the goal was sent."
TOO_EARLY = "It was ended before the action server took it."
GONE = "The connection was lost meanwhile, and the action server does not know the goal any more."
SILENT = "The action server has said nothing for {:.0f} s."
NO_FEEDBACK = "The action server has told of no progress for {:.0f} s."
UNSERVED = "The action server is there no more."
RESULT_LATE = "Its result has not come."
TAKEN_LATE = "The action server took it {:.1f} s after it was sent; it was cancelled at once."
BACK_LATE = "The action server spoke of it {:.1f} s after it was sent; it was cancelled at once."
PAUSES_S = (0.1, 0.2, 0.4, 0.8, 1.6, *30 * (4.0,))
"""Between two attempts to cancel a goal that goes on though it was withdrawn."""
N_KEPT = 50
LONGEST_LOOK_S = 2.0
"""Most silence counted between two looks, in robot time: more means that the clock was set."""

logger = logging.getLogger(__name__)


class ActionClient(ABC):
    """Sends goals to one action, and follows each until the action server has ended it.

    A goal that we reported as over is *withdrawn*: one that was not taken in time, that was ended
    before it was taken, or whose server fell silent. Should the server take it, or still have it,
    it is cancelled again and again until the server has ended it, and `afterwards` tells so.

    Attributes:
        ends_others: Ending includes goals of other clients, which move the robot as ours do.
        listeners: Called at every news of any goal; they must not raise.
    """

    def __init__(
        self,
        connection: RosConnection,
        action: str,
        *,
        type_name: str,
        statuses: Subscription,
    ) -> None:
        self.action = action
        self.type_name = type_name
        self.ends_others = False
        self.listeners: list[Callable[[], None]] = []
        self._connection = connection
        self._patience = connection.patience
        self._list = statuses
        self._goals: dict[str, ActionGoal] = {}
        self._being_ended: set[str] = set()
        self._statuses: dict[str, ActionState] = {}
        self._feedback_within_s = math.inf
        self._now_s: Callable[[], float] = anyio.current_time
        self._looked_s = math.inf

    # --- known goals

    @property
    def is_busy(self) -> bool:
        """True while a goal of ours is under way, or may be."""
        return bool(self.open_goals)

    @property
    def owners(self) -> frozenset[str]:
        """The clients with whom goals end that are under way."""
        return frozenset(goal.owner for goal in self.open_goals if goal.owner is not None)

    @property
    def goals(self) -> list[ActionGoal]:
        """Our goals, in the order in which they were sent; of those that are over, the latest."""
        return list(self._goals.values())

    @property
    def open_goals(self) -> list[ActionGoal]:
        """Our goals that are not over, in the order in which they were sent."""
        return [goal for goal in self.goals if not goal.is_over]

    @property
    def listed(self) -> Mapping[str, ActionState]:
        """The goals that the action server knows, ours and others', by its own ids."""
        return self._statuses

    @property
    def ours(self) -> Mapping[str, ActionGoal]:
        """Our own goals by the server's ids, as far as these are known."""
        return {goal.server_id: goal for goal in self._goals.values() if goal.server_id}

    @property
    def others(self) -> Mapping[str, ActionState]:
        """The states of other clients' goals under way, as far as these can be told apart."""
        ours = self.ours
        return {
            server_id: state
            for server_id, state in self._statuses.items()
            if not state.is_final and server_id not in ours
        }

    @property
    def listed_s(self) -> float:
        """When the list of the goals came, by the event loop's clock."""
        return self._list.arrived_s

    async def wait_for_list(self) -> None:
        """Wait a moment for the goals there are; a server without goals need not have said so."""
        left_s = self._list.begun_s + self._patience.listing_s - anyio.current_time()
        if self._list.n_received == 0 and left_s > 0.0:
            with suppress(LinkError):
                await self._list.wait_for_more_than(0, timeout_s=left_s)

    def look(self) -> None:
        """Take in that time has passed: a long silence may end a goal."""
        now_s = self._now_s()
        passed_s = min(max(now_s - self._looked_s, 0.0), LONGEST_LOOK_S)
        self._looked_s = now_s
        for goal in self.open_goals:
            self._look_at(goal)
            if goal.n_feedback > 0 and self._connection.connected_for_s is not None:
                goal.silent_s += passed_s
            if goal.silent_s > self._feedback_within_s and not goal.is_over:
                self._withdraw(goal, ActionState.LOST, NO_FEEDBACK.format(goal.silent_s))
        self._tell()

    def expect_feedback(self, *, within_s: float, now_s: Callable[[], float]) -> None:
        """Take for lost a goal whose feedback has come once and then stays away; in robot time."""
        self._feedback_within_s, self._now_s = within_s, now_s

    # --- commands

    def advertise(self, through: RosConnection) -> dict[str, str]:
        """Say that we will publish, where that is needed; return the types by topic."""
        del through
        return {}

    async def send(
        self,
        arguments: Message,
        *,
        through: RosConnection,
        owner: str | None = None,
        n_stops: int | None = None,
    ) -> ActionGoal:
        """Send a goal; `wait_until_taken` has to follow.

        Args:
            arguments: The goal's fields.
            through: The connection to send it over, and to cancel it; it may be guarded.
            owner: The client with whom it ends; None where the caller ends it.
            n_stops: The number of stops when the goal was requested; None for the present one.

        Raises:
            GoalError: There was a stop since the goal was requested.
            LinkError: It could not be sent.
        """
        started = self._connection.started
        n_stops = started.n_stops if n_stops is None else n_stops
        await self.wait_for_list()
        if n_stops != started.n_stops:
            raise GoalError(STOPPED, hint="Send it again when the robot may move.")
        started.n_begun += 1
        sent_s = anyio.current_time()
        goal = await self._begin(arguments, through)
        goal.owner, goal.sent_s = owner, sent_s
        self._forget_settled()
        if n_stops != started.n_stops:
            self._withdraw(goal, ActionState.CANCELLED, TOO_EARLY)
        return goal

    async def wait_until_taken(self, goal: ActionGoal) -> None:
        """Return when the server has taken or refused a goal; withdraw one that it does not."""
        with self.giving_up(goal):
            is_taken = await goal.wait_until(
                lambda: goal.state is not ActionState.SENT, within_s=self._patience.acceptance_s
            )
        if not is_taken:
            reason = NOT_TAKEN.format(self._patience.acceptance_s)
            self._withdraw(goal, ActionState.REJECTED, reason)

    @contextmanager
    def giving_up(self, goal: ActionGoal) -> Generator[None]:
        """End a goal whose sender gives up waiting in the `with` block: nobody else knows of it."""
        try:
            yield
        except anyio.get_cancelled_exc_class():
            if goal.state is ActionState.SENT:
                self._withdraw(goal, ActionState.CANCELLED, GIVEN_UP)
            elif not goal.is_over:
                self._ask_to_cancel(goal)
            raise

    async def cancel(self, goal: ActionGoal) -> None:
        """End one goal, and wait a moment for its end.

        Raises:
            LinkError: The server refuses, cannot be told, or goes on with the goal.
        """
        if goal.state is ActionState.SENT:
            self._withdraw(goal, ActionState.CANCELLED, TOO_EARLY)
        elif not goal.is_over:
            await self._cancel(goal)
            await self._check_ended([goal])

    async def end(self) -> bool:
        """End every goal of ours, and where they move the robot too, those of others.

        Returns whether a server was there to be told; False also if nothing was under way.

        Raises:
            LinkError: Names the goals that could not be ended.
        """
        self._connection.started.n_stops += 1
        taken = [goal for goal in self.open_goals if goal.state is not ActionState.SENT]
        for goal in self.open_goals:
            if goal not in taken:
                self._withdraw(goal, ActionState.CANCELLED, TOO_EARLY)
            elif self.ends_others:
                self._ask_to_cancel(goal)
        if self.ends_others:
            await self.cancel_all()
        else:
            await self._cancel_each(taken)
        await self._check_ended(taken)
        self._tell()
        return bool(taken) or (self.ends_others and await self._is_served())

    @abstractmethod
    async def cancel_all(self, through: RosConnection | None = None) -> int:
        """Cancel every goal of the action, of all clients; return how many there were.

        Raises:
            LinkError: The server refuses, or cannot be told.
        """

    # --- inside: each ROS in its own way

    async def _is_served(self) -> bool:
        """Return whether a server has received `cancel_all`; a cancel service has answered."""
        return True

    @abstractmethod
    async def _begin(self, arguments: Message, through: RosConnection) -> ActionGoal:
        """Send a goal, and keep it."""

    def _keep(self, goal: ActionGoal, through: RosConnection) -> None:
        goal.type, goal.through = self.type_name, through
        self._goals[goal.id] = goal

    @abstractmethod
    def _ask_to_cancel(self, goal: ActionGoal) -> None:
        """Ask at once for the end of a goal, whatever comes of it."""

    @abstractmethod
    async def _cancel(self, goal: ActionGoal) -> bool:
        """Ask for the end of a goal; return True when the server says that it has ended."""

    @abstractmethod
    def _look_at(self, goal: ActionGoal) -> None:
        """Take in that time has passed for a goal."""

    # --- inside: withdrawing, once for all

    def _withdraw(self, goal: ActionGoal, state: ActionState, reason: str) -> None:
        """Say that a goal is over, and see to it that the server sees it so."""
        goal.is_withdrawn = True
        goal.finish(state, reason=reason)
        self._ask_to_cancel(goal)
        self._tell()

    def _note_life(self, goal: ActionGoal) -> None:
        """Take in that the server has a goal; one that was withdrawn is cancelled at once."""
        if goal.is_withdrawn and not goal.is_settled and goal.id not in self._being_ended:
            self._being_ended.add(goal.id)
            said = BACK_LATE if goal.state is ActionState.LOST else TAKEN_LATE
            goal.afterwards = said.format(anyio.current_time() - goal.sent_s)
            logger.warning("A goal of %s that was withdrawn: %s", self.action, goal.afterwards)
            self._connection.start_soon(partial(self._end_for_certain, goal))

    def _note_server_end(self, goal: ActionGoal) -> None:
        """Take in that the server has ended a goal that was withdrawn."""
        if goal.is_withdrawn and not goal.is_settled:
            goal.settle()

    async def _end_for_certain(self, goal: ActionGoal) -> None:
        """Cancel a goal until the server has ended it."""
        for pause_s in PAUSES_S:
            try:
                if goal.is_settled or await self._cancel(goal):
                    goal.settle()
            except LinkError as error:
                logger.warning("A late goal of %s is not cancelled yet: %s", self.action, error)
            if await goal.wait_until(lambda: goal.is_settled, within_s=pause_s):
                break
        self._being_ended.discard(goal.id)

    async def _cancel_each(self, goals: Iterable[ActionGoal]) -> None:
        """Ask for the end of all goals; raise `LinkError` when one of them was refused."""
        faults: list[LinkError] = []
        for goal in goals:
            try:
                await self._cancel(goal)
            except LinkError as error:
                faults.append(error)
        if faults:
            raise faults[0]

    async def _check_ended(self, goals: Iterable[ActionGoal]) -> None:
        with anyio.move_on_after(self._patience.end_s):
            for goal in goals:
                await goal.wait_until_over(within_s=self._patience.end_s)
        going = sum(not goal.is_over for goal in goals)
        if going:
            raise LinkError(
                f"{self.action} was told to end {'its goal' if going == 1 else f'{going} goals'}, "
                f"but has not within {self._patience.end_s:g} s.",
                hint="If the robot still moves, stop it by hand.",
            )

    def _forget_settled(self) -> None:
        """Forget goals that are over on both sides; of withdrawn ones the latest are kept."""
        over = [each for each in self.goals if each.is_over and each.id not in self._being_ended]
        for goal in over[: max(len(over) - N_KEPT, 0)]:
            del self._goals[goal.id]

    def _tell(self) -> None:
        for listener in self.listeners:
            listener()
