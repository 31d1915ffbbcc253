"""Approval requests: commands, or all drives of a call, that a person has to agree to."""

import json
import secrets
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from mapspeak.errors import ConfigError
from mapspeak.memory.quoting import clean_line
from mapspeak.safety.commands import Command, is_same, say_whole


@dataclass(frozen=True, slots=True, kw_only=True)
class ApprovalScope:
    """What one tool call may drive and command once a person agrees, with its bounds.

    Attributes:
        what: In words, as in "may the robot explore".
        n_drives: The most drives it covers.
        duration_s: Robot time that it lasts from the first drive on.
        n_commands: The most other commands it covers; with 0 each needs an approval of its own.
    """

    what: str
    n_drives: int
    duration_s: float
    n_commands: int = 0

    @property
    def said(self) -> str:
        """The scope with its bounds, in words."""
        drives = "one drive" if self.n_drives == 1 else f"up to {self.n_drives} drives"
        n_others = f"{self.n_commands} other command{'s' if self.n_commands > 1 else ''}"
        commands = f" and {n_others}" if self.n_commands else ""
        return f"{self.what}, {drives}{commands} within {self.duration_s:g} s"


# State of a task, not of the module: what the present call is for.
_SCOPE: ContextVar[ApprovalScope | None] = ContextVar("scope", default=None)


def current_scope() -> ApprovalScope | None:
    """Return the scope that drives are for now; None where each is for itself."""
    return _SCOPE.get()


@contextmanager
def within_scope(scope: ApprovalScope) -> Generator[None]:
    """Mark the drives that are begun in the `with` block as parts of a scope."""
    token = _SCOPE.set(scope)
    try:
        yield
    finally:
        _SCOPE.reset(token)


# Likewise: the person's word for the skill that gives commands now.
_WORD: ContextVar[str] = ContextVar("word", default="")


def current_word() -> str:
    """Return the id of the word that covers what is commanded now; empty where none does."""
    return _WORD.get()


@contextmanager
def covered_by(word: str) -> Generator[None]:
    """Let a word that allowed a skill cover the commands that it gives in the `with` block."""
    token = _WORD.set(word)
    try:
        yield
    finally:
        _WORD.reset(token)


@dataclass(slots=True)
class _Approved:
    """A scope that a person has agreed to, as far as it is used up."""

    request_id: str
    begun_s: float
    n_left: int
    n_commands_left: int


class ApprovalScopes:
    """The scopes that a person has agreed to, of all clients."""

    def __init__(self) -> None:
        self._approved: dict[tuple[str, ApprovalScope], _Approved] = {}

    def begin(self, scope: ApprovalScope, *, client: str, request_id: str, robot_s: float) -> None:
        """Note that a person has agreed; the first drive is yet to be taken."""
        self._approved[client, scope] = _Approved(
            request_id, robot_s, scope.n_drives, scope.n_commands
        )

    def take_part(
        self, scope: ApprovalScope, *, client: str, robot_s: float, is_drive: bool
    ) -> str | None:
        """Use up one command and return the id of the word that covers it; None where none does."""
        approved = self._approved.get((client, scope))
        if approved is None:
            return None
        is_in_time = 0 <= robot_s - approved.begun_s < scope.duration_s
        n_left = approved.n_left if is_drive else approved.n_commands_left
        if not is_in_time or n_left < 1:
            del self._approved[client, scope]
            return None
        approved.n_left -= is_drive
        approved.n_commands_left -= not is_drive
        return approved.request_id

    def end(self, scope: ApprovalScope, *, client: str) -> None:
        """Forget one: what is left of it covers nothing more."""
        self._approved.pop((client, scope), None)

    def end_all(self) -> None:
        """Forget them: after a stop a person is asked again."""
        self._approved.clear()


VALID_S = 600.0
"""An approval is valid for this long, and for one command."""
MOST_WAITING = 50


Wanted = Command | ApprovalScope
"""What a person's word may be for: one command, or the drives of a scope."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Request:
    """An approval request of a client.

    Attributes:
        asked_s: When, by the same clock as all times here.
        secret: What an answer of that client must know, beside the id.
    """

    id: str
    wanted: Wanted
    client: str
    asked_s: float
    secret: str = field(default_factory=lambda: secrets.token_hex(16), repr=False)


@dataclass(frozen=True, slots=True)
class WaitingRoom:
    """A folder in which a server writes what waits, and an operator what is approved."""

    folder: Path

    def add(self, request_id: str, said: str, *, server: str) -> None:
        """Write a command that waits, and for which server: ids of two servers may be the same."""
        self.folder.mkdir(parents=True, exist_ok=True)
        written = json.dumps({"what": said, "server": server})
        self._file(request_id, "waiting").write_text(written, encoding="utf-8")

    def list_waiting(self) -> dict[str, str]:
        """Return what waits, each on one line, by its id."""
        waiting = {}
        for path in sorted(self.folder.glob("*.waiting")):
            try:
                what = str(json.loads(path.read_text(encoding="utf-8"))["what"])
                waiting[clean_line(path.stem)] = clean_line(what)
            except (OSError, ValueError, KeyError, TypeError):
                continue
        return waiting

    def approve(self, request_id: str) -> str:
        """Approve a waiting command and return it in words.

        Raises:
            ConfigError: Nothing waits under that id.
        """
        said = self._require_waiting(request_id)
        self._file(request_id, "waiting").rename(self._file(request_id, "approved"))
        return said

    def refuse(self, request_id: str) -> str:
        """Take a waiting command off the list and return it in words.

        Raises:
            ConfigError: Nothing waits under that id.
        """
        said = self._require_waiting(request_id)
        self._file(request_id, "waiting").unlink(missing_ok=True)
        return said

    def take_approved(self, request_id: str, *, server: str) -> bool:
        """Return whether a command of a server was approved; once."""
        approved = self._file(request_id, "approved")
        try:
            is_ours = bool(json.loads(approved.read_text(encoding="utf-8"))["server"] == server)
            if is_ours:
                approved.unlink()
        except (OSError, ValueError, KeyError, TypeError):
            return False
        return is_ours

    def _require_waiting(self, request_id: str) -> str:
        waiting = self.list_waiting()
        if request_id not in waiting:
            raise ConfigError(
                f"Nothing waits for approval under {request_id!r}.",
                hint=f"There waits: {', '.join(waiting) or 'nothing'}.",
            )
        return waiting[request_id]

    def remove(self, request_id: str) -> None:
        """Forget a command."""
        for state in ("waiting", "approved"):
            self._file(request_id, state).unlink(missing_ok=True)

    def _file(self, request_id: str, state: str) -> Path:
        return self.folder / f"{request_id}.{state}"


@dataclass(slots=True)
class Approvals:
    """What waits for a person's word in one server.

    Attributes:
        now_s: Seconds that only grow.
    """

    room: WaitingRoom
    now_s: Callable[[], float]
    _requests: dict[str, _Request] = field(default_factory=dict)
    _asked: set[str] = field(default_factory=set)
    _granted: set[str] = field(default_factory=set)
    _n_requests: int = 0
    _server: str = field(default_factory=lambda: secrets.token_hex(16))

    def ask(self, wanted: Wanted, *, client: str) -> str:
        """Note a request and return its id; the same one for the same request."""
        self._forget_old()
        for known in self._requests.values():
            if _is_of(known, wanted, client):
                return known.id
        self._n_requests += 1
        request_id = f"{self._server[:4]}-{self._n_requests}"
        self._requests[request_id] = _Request(
            id=request_id, wanted=wanted, client=client, asked_s=self.now_s()
        )
        return request_id

    def fresh_room(self) -> WaitingRoom:
        """Return the waiting room, without those of this server's commands that have run out."""
        self._forget_old()
        return self.room

    def queue(self, request_id: str) -> None:
        """Let a request wait for `mapspeak approve`."""
        request = self._requests[request_id]
        who = f", asked by {request.client}" if request.client else ""
        self.room.add(request_id, f"{_say(request.wanted)}{who}", server=self._server)

    def ask_client(self, request_id: str) -> str:
        """Note that the client is asked now, and return the secret that its answer must know."""
        self._asked.add(request_id)
        return self._requests[request_id].secret

    def grant(self, request_id: str, *, client: str, secret: str) -> bool:
        """Note a person's word for a request, once; return False when that client was not asked."""
        request = self._requests.get(request_id)
        if request is None or request_id not in self._asked or request.client != client:
            return False
        if not secrets.compare_digest(request.secret.encode(), secret.encode()):
            return False
        self._asked.discard(request_id)
        self._granted.add(request_id)
        return True

    def take_word(self, wanted: Wanted, *, client: str) -> str | None:
        """Return the id of the word that a person gave for this request of this client, once."""
        self._forget_old()
        for request in list(self._requests.values()):
            if not _is_of(request, wanted, client):
                continue
            is_granted = request.id in self._granted
            if is_granted or self.room.take_approved(request.id, server=self._server):
                self._forget(request.id)
                return request.id
        return None

    def close(self) -> None:
        """Forget everything: what waits here can no longer be done."""
        for request_id in list(self._requests):
            self._forget(request_id)

    def _forget_old(self) -> None:
        oldest_s = self.now_s() - VALID_S
        old = [each.id for each in self._requests.values() if each.asked_s < oldest_s]
        surplus = list(self._requests)[: max(len(self._requests) - MOST_WAITING, 0)]
        for request_id in {*old, *surplus}:
            self._forget(request_id)

    def _forget(self, request_id: str) -> None:
        del self._requests[request_id]
        self._asked.discard(request_id)
        self._granted.discard(request_id)
        self.room.remove(request_id)


def _is_of(request: _Request, wanted: Wanted, client: str) -> bool:
    if isinstance(request.wanted, ApprovalScope) or isinstance(wanted, ApprovalScope):
        return request.client == client and request.wanted == wanted
    return request.client == client and is_same(request.wanted, wanted)


def _say(wanted: Wanted) -> str:
    return wanted.said if isinstance(wanted, ApprovalScope) else say_whole(wanted)
