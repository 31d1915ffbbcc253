"""One guard of a robot: its policy, and one revision of each map with what is closed now."""

import logging
from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial

import anyio
import anyio.to_thread

from mapspeak.errors import ConfigError, PolicyError
from mapspeak.hold import Hold
from mapspeak.installation import shell_command
from mapspeak.memory.events import Effect, Event
from mapspeak.places.recall.events import (
    close_floor_of,
    find_hindrances,
    say_events,
    say_unplaced,
)
from mapspeak.safety.approvals import (
    Approvals,
    ApprovalScope,
    ApprovalScopes,
    current_scope,
    current_word,
)
from mapspeak.safety.audit import NOBODY, AuditLog, Caller, current_caller
from mapspeak.safety.commands import Command, CommandKind, DriveCommand
from mapspeak.safety.deciding import Allowed, Decision, NeedsApproval, Refused, Situation, decide
from mapspeak.safety.policy import AreaRule, Otherwise, Policy
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.keepout import ClosedArea, Outline, mask_areas, outlines_of_region
from mapspeak.worldmodel.revision import MapRevision

logger = logging.getLogger(__name__)


class MapReviser:
    """Makes the revisions of a robot's map.

    Args:
        rules: Which areas are closed, and when.
        wall_clock: The operator's.
        read_events: Gives the events that are remembered. They close what they say, and never
            open what a rule closes.
        leaves_pockets: A robot that a gap too narrow by a cell shuts in gets out of it.
    """

    def __init__(
        self,
        rules: Sequence[AreaRule],
        *,
        wall_clock: Callable[[], datetime],
        read_events: Callable[[], Sequence[Event]] = tuple,
        leaves_pockets: bool = False,
    ) -> None:
        self._rules = tuple(rules)
        self._read_events = read_events
        self._wall_clock = wall_clock
        self._leaves_pockets = leaves_pockets
        self._turn = anyio.Lock()
        self._latest: MapRevision | None = None
        self._warned: set[str] = set()

    @property
    def has_rules(self) -> bool:
        """True when there is anything that may be closed, now or at another hour."""
        has_closure = any(each.effect is Effect.CLOSED for each in self._read_events())
        return bool(self._rules) or has_closure

    @property
    def latest(self) -> MapRevision | None:
        """The revision that was made last; its areas are those that were closed then."""
        return self._latest

    async def revise(self, grid: OccupancyGrid, *, radius_m: float) -> MapRevision:
        """Return the revision of a map: the same one while map and closed areas are the same."""
        async with self._turn:
            self._latest = await anyio.to_thread.run_sync(self._revise, grid, radius_m)
            return self._latest

    def describe(self, revision: MapRevision) -> tuple[str, ...]:
        """Return events in words, but notes of a place, and which rules are of no region here."""
        events, now = self._read_events(), self._wall_clock()
        told = (each for each in events if not each.is_note_of_place)
        return (
            *self._say_off(revision),
            *say_events(told, now),
            *say_unplaced(events, revision, now),
        )

    def _say_off(self, revision: MapRevision) -> Iterator[str]:
        """Tell each rule that closes nothing on a map."""
        for rule in self._rules:
            if rule.region_id and revision.rooms.find_region(rule.region_id) is None:
                yield f"The policy closes {rule.region_id} ({rule.name}), which is not on this map."
        for rule in self._rules:
            if rule.outline and _is_off(rule, revision.grid):
                yield f"The policy's area {rule.name!r} lies off this map: it closes nothing here."

    def _revise(self, grid: OccupancyGrid, radius_m: float) -> MapRevision:
        before = self._latest
        if before is not None and before.radius_m == radius_m and before.is_of(grid):
            revision = before
        else:
            revision = MapRevision(
                grid, radius_m=radius_m, previous=before, leaves_pockets=self._leaves_pockets
            )
            self._warn(revision)
        events, now = self._read_events(), self._wall_clock()
        areas = (*self._find_closed(revision), *close_floor_of(events, revision, now))
        hindrances = tuple(find_hindrances(events, revision, now))
        if areas == revision.areas and hindrances == revision.hindrances:
            return revision
        return revision.with_areas(areas, hindrances)

    def _warn(self, revision: MapRevision) -> None:
        """Tell the operator at once, and once, which rules close nothing."""
        for each in self._say_off(revision):
            if each not in self._warned:
                self._warned.add(each)
                logger.warning("%s", each)

    def _find_closed(self, revision: MapRevision) -> Iterator[ClosedArea]:
        now = self._wall_clock()
        for rule in self._rules:
            ends = None if rule.hours is None else rule.hours.end_of(now)
            if rule.hours is not None and ends is None:
                continue
            until = "" if ends is None else f"{ends:%H:%M}"
            for outline, *further in _outlines_of(rule, revision):
                yield ClosedArea(
                    name=rule.name,
                    outline=outline,
                    further_outlines=tuple(further),
                    until=until,
                    reason=rule.reason,
                )


def _is_off(rule: AreaRule, grid: OccupancyGrid) -> bool:
    area = ClosedArea(name=rule.name, outline=rule.outline, further_outlines=rule.further_outlines)
    return bool(grid.cells.size) and not mask_areas(grid, [area]).any()


def _outlines_of(rule: AreaRule, revision: MapRevision) -> Iterator[tuple[Outline, ...]]:
    """Return the outlines of each area that a rule closes."""
    if rule.outline:
        yield (rule.outline, *rule.further_outlines)
        return
    region = revision.rooms.find_region(rule.region_id)
    if region is not None:
        yield from ((outline,) for outline in outlines_of_region(revision.rooms, region))


MINUTE_S = 60.0
MOST_KEPT = 10_000


class RateLog:
    """Counts commands in the last minute of robot time, whichever way its clock jumps."""

    def __init__(self) -> None:
        self._times_s: dict[CommandKind, deque[float]] = defaultdict(
            lambda: deque(maxlen=MOST_KEPT)
        )

    def note(self, kind: CommandKind, now_s: float) -> None:
        """Count a command."""
        self._times_s[kind].append(now_s)

    def count(self, kind: CommandKind, now_s: float) -> int:
        """Return how many commands there were within a minute of now."""
        times_s = self._times_s[kind]
        while times_s and now_s - times_s[0] >= MINUTE_S:
            times_s.popleft()
        return sum(abs(now_s - each_s) < MINUTE_S for each_s in times_s)


class ApprovalNeededError(PolicyError):
    """A person has to agree first.

    Attributes:
        request_id: What to grant when the person agrees.
    """

    def __init__(self, question: str, *, request_id: str, hint: str) -> None:
        super().__init__(f"A person must agree first. {question}", hint=hint)
        self.question = question
        self.request_id = request_id


@dataclass(frozen=True, slots=True, kw_only=True)
class Permit:
    """A command that was allowed.

    Attributes:
        number: Of the command in the audit log.
        by: The person's word for it; empty where none was needed.
    """

    number: int
    command: Command
    caller: Caller
    by: str = ""


@dataclass(slots=True, kw_only=True)
class Guard:
    """Holds commands to a policy; every wrapper of a port asks the same one.

    Attributes:
        hold: What keeps the robot standing.
        wall_clock: The operator's; of a robot under a virtual clock one that moves on as that does.
        robot: What the operator calls it; empty leaves that to the robot.
        address: Where the robot is; empty for one that no other process can reach.
    """

    policy: Policy
    audit: AuditLog
    hold: Hold
    approvals: Approvals
    wall_clock: Callable[[], datetime]
    robot: str = ""
    address: str = ""
    _rates: RateLog = field(default_factory=RateLog)
    _scopes: ApprovalScopes = field(default_factory=ApprovalScopes)

    def warn_of_servers(self) -> tuple[str, ...]:
        """Tell of other servers that drive the same robot."""
        return tuple(
            f"Another mapspeak server, process {process}, drives this robot too: their goals "
            "replace each other and their velocities alternate. Let a person end one of them."
            for process in self.hold.servers_of(self.address)
        )

    def clear(
        self, command: Command, *, robot_s: float, objection: Refused | None = None
    ) -> Permit:
        """Allow a command, and note that; between this and the command nothing may wait.

        Args:
            objection: What is against it by where it leads.

        Raises:
            ApprovalNeededError: A person has to agree first.
            GoalError: The robot must not drive there; another goal may do.
            PolicyError: It is not allowed, or could not be noted.
        """
        caller = current_caller()
        permit = Permit(number=self.audit.next_number(), command=command, caller=caller)
        decision = self._decide(command, caller, robot_s, objection)
        verdict, said = _say_decision(decision)
        self._note("decision", permit, robot_s=robot_s, verdict=verdict, said=said)
        match decision:
            case Refused(error=error):
                raise error
            case NeedsApproval(question=question):
                raise self._ask(command, question, caller)
            case Allowed(by=by):
                self._rates.note(command.kind, robot_s)
                permit = replace(permit, by=by)
        return permit

    def note_result(self, permit: Permit, said: str, *, robot_s: float) -> None:
        """Note what the robot answered to a command that was allowed."""
        self._note_after("result", permit, robot_s=robot_s, said=said)

    def note_end(self, permit: Permit, said: str, *, robot_s: float) -> None:
        """Note how something that took a while has ended."""
        self._note_after("ended", permit, robot_s=robot_s, said=said)

    def note_leg(self, permit: Permit, said: str, *, robot_s: float) -> None:
        """Note that the robot is sent on within a drive that was allowed.

        Raises:
            PolicyError: The line could not be written.
        """
        self._note("leg", permit, robot_s=robot_s, said=said)

    def note_event(self, event: str, said: str, *, robot_s: float) -> None:
        """Note a stop or a release. It never fails: stopping goes first."""
        try:
            self.audit.write(
                event,
                number=self.audit.next_number(),
                caller=current_caller(),
                robot_s=robot_s,
                said=said,
            )
        except PolicyError as error:
            logger.error("%s", error)  # noqa: TRY400 - it says all there is to say

    def latch(self) -> None:
        """Hold the robot after a client's stop, where the policy says so."""
        caller = current_caller()
        if caller is NOBODY or not self.policy.latches_on_stop:
            return
        try:
            self.hold.put(f"{caller.tool or 'a client'} stopped it", at=self.wall_clock())
        except ConfigError as error:
            logger.error("%s", error)  # noqa: TRY400 - it says all there is to say

    def _decide(
        self, command: Command, caller: Caller, robot_s: float, objection: Refused | None
    ) -> Decision:
        situation = replace(self._situation(command, robot_s), objection=objection)
        word = current_word()
        if word:
            situation = replace(situation, is_approved=True)
        decision = decide(command, policy=self.policy, situation=situation)
        if not isinstance(decision, NeedsApproval):
            return Allowed(by=word) if word and isinstance(decision, Allowed) else decision
        scope = _scope_of(command)
        if scope is None:
            request_id = self.approvals.take_word(command, client=caller.client)
        else:
            is_drive = isinstance(command, DriveCommand)
            request_id = self._take_part(scope, caller.client, robot_s, is_drive=is_drive)
            question = f"May the robot {scope.said}? The limits of its policy stay."
            decision = NeedsApproval(question=question)
        if request_id is None:
            return decision
        return Allowed(by=request_id if scope is None else f"{request_id}: {scope.said}")

    def _take_part(
        self, scope: ApprovalScope, client: str, robot_s: float, *, is_drive: bool
    ) -> str | None:
        """Return the word that covers one more command of a scope; None where none does."""
        take = partial(
            self._scopes.take_part, scope, client=client, robot_s=robot_s, is_drive=is_drive
        )
        request_id = take()
        if request_id is not None:
            return request_id
        request_id = self.approvals.take_word(scope, client=client)
        if request_id is None:
            return None
        self._scopes.begin(scope, client=client, request_id=request_id, robot_s=robot_s)
        return take()

    def end_scopes(self) -> None:
        """Let a person be asked again for what is left of scopes: the robot was stopped."""
        self._scopes.end_all()

    def end_scope(self, scope: ApprovalScope) -> None:
        """Forget what is left of a scope: it is done."""
        self._scopes.end(scope, client=current_caller().client)

    def _situation(self, command: Command, robot_s: float) -> Situation:
        n_lately = self._rates.count(command.kind, robot_s)
        return Situation(held_by=self.hold.read(), n_in_last_minute=n_lately)

    def _ask(self, command: Command, question: str, caller: Caller) -> ApprovalNeededError:
        request_id = self.approvals.ask(_scope_of(command) or command, client=caller.client)
        hint = "The client cannot ask anybody: tell the person that the policy wants their word."
        if self.policy.approval.otherwise is Otherwise.QUEUE:
            self.approvals.queue(request_id)
            hint = f"Call again once a person has typed `{shell_command(f'approve {request_id}')}`."
        return ApprovalNeededError(question, request_id=request_id, hint=hint)

    def _note(
        self, event: str, permit: Permit, *, robot_s: float, verdict: str = "", said: str
    ) -> None:
        self.audit.write(
            event,
            number=permit.number,
            caller=permit.caller,
            robot_s=robot_s,
            command=permit.command,
            verdict=verdict,
            said=said,
        )

    def _note_after(self, event: str, permit: Permit, *, robot_s: float, said: str) -> None:
        """Note what has happened already: an error here could only hide it."""
        try:
            self._note(event, permit, robot_s=robot_s, said=said)
        except PolicyError as error:
            logger.error("%s", error)  # noqa: TRY400 - it says all there is to say


def _say_decision(decision: Decision) -> tuple[str, str]:
    match decision:
        case Refused(rule=rule, error=error):
            return "refused", f"{rule}: {error.message}"
        case NeedsApproval(question=question):
            return "needs approval", question
        case Allowed(by=by):
            return "allowed", f"by approval {by}" if by else ""


def _scope_of(command: Command) -> ApprovalScope | None:
    """Return what a command is a part of; None for one that is for itself."""
    scope = current_scope()
    is_part = scope is not None and (isinstance(command, DriveCommand) or scope.n_commands > 0)
    return scope if is_part else None
