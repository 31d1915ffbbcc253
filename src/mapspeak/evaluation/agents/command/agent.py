"""The command agent: a client program with the server configured, judged by the server's log."""

import json
import os
import signal
import sys
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import anyio
from anyio.abc import ByteReceiveStream, Process

from mapspeak.errors import LinkError
from mapspeak.evaluation.agents.command import keeper
from mapspeak.evaluation.agents.command.program import ALWAYS, AnswerForm, Program, Start
from mapspeak.evaluation.agents.models.chat import Thinking
from mapspeak.evaluation.client import OutOfBudgetError, Picture, ToolAnswer, ToolClient, Witness
from mapspeak.evaluation.trials import AgentEnd, Assignment, ServerAccess, TrialState

EVERY_S = 0.1


@dataclass(slots=True)
class Listener:
    """Reads a growing call log, and tells a witness of each call in it.

    Attributes:
        log: The file; it may not be there yet.
        witness: Who is told; None for nobody.
        n_heard: Calls so far.
    """

    log: Path
    witness: Witness | None
    n_heard: int = field(default=0, init=False)
    _n_read: int = field(default=0, init=False)

    async def listen(self) -> None:
        """Listen until it is cancelled.

        Raises:
            OutOfBudgetError: The witness has heard more than may be.
        """
        while True:
            self.hear_new()
            # A file has no event that every system would tell us of.
            await anyio.sleep(EVERY_S)

    def hear_new(self) -> None:
        """Tell of every whole line that was not there before.

        Raises:
            OutOfBudgetError: The witness has heard more than may be.
        """
        if not self.log.exists():
            return
        with self.log.open("rb") as file:
            file.seek(self._n_read)
            lines = file.read().rpartition(b"\n")[0]
        for line in lines.split(b"\n") if lines else ():
            self._n_read += len(line) + 1
            self.n_heard += 1
            self._tell(json.loads(line))

    def _tell(self, line: dict[str, Any]) -> None:
        if self.witness is None:
            return
        answer = ToolAnswer(
            text=line["text"],
            pictures=tuple(self._read_picture(name) for name in line["pictures"]),
            report=line["report"],
            is_error=line["is_error"],
        )
        self.witness.hear_call(line["tool"], line["arguments"])
        self.witness.hear_answer(line["tool"], answer)

    def _read_picture(self, name: str) -> Picture:
        path = self.log.with_suffix("") / name
        return Picture(path.read_bytes(), "image/jpeg" if path.suffix == ".jpg" else "image/png")


MOST_BYTES = 4_000_000
"""Of what a program writes; only the last of it is kept."""
WRAP_UP_S = 10.0
"""So long before its time is up a program is ended, so that its server can write the map."""
CONTROL, SERVED = "control", "served"
"""Where in a trial's folder servers write down that they serve."""
GRACE_S = 5.0
LAST_WORDS = 500
LEAST_SECRET = 6
"""Characters; what is shorter is no secret, and would be struck out all over the text."""


@dataclass(slots=True)
class _Course:
    """What a run of a program has come to."""

    said: bytearray = field(default_factory=bytearray)
    complained: bytearray = field(default_factory=bytearray)
    exit_code: int | None = None
    over: OutOfBudgetError | None = None


@dataclass(frozen=True, slots=True)
class CommandAgent:
    """Runs a program in a folder of the trial; its variables are passed by name, never written.

    Attributes:
        program: Which one.
        name: As in `Trial.agent`.
        thinking: How much it may think; None for as it likes.
        connection: It starts the server itself.
    """

    program: Program
    name: str
    thinking: Thinking | None = None
    connection: ServerAccess = field(default=ServerAccess.COMMAND, kw_only=True)

    def check(self) -> None:
        """Return when the program is there.

        Raises:
            ConfigError: It is not.
        """
        self.program.check(self.thinking)

    async def run(self, task: Assignment, tools: ToolClient) -> AgentEnd:
        """Carry out the assignment.

        Raises:
            LinkError: The program failed by itself.
        """
        self.check()
        folder, log = task.folder / "client", task.folder / "calls.jsonl"
        folder.mkdir(parents=True, exist_ok=True)
        start = Start(
            prompt="\n\n".join(filter(None, (task.system, task.prompt))),
            server=(*task.server, "--call-log", str(log)),
            folder=folder,
            thinking=self.thinking,
        )
        start.write_config(self.program)
        log.unlink(missing_ok=True)
        start.answer.unlink(missing_ok=True)
        course, variables = _Course(), _choose_variables(self.program)
        listener = Listener(log, tools.witness)
        try:
            await _run(
                start.command(self.program),
                start=start,
                variables={**variables, **self.program.settings},
                listener=listener,
                course=course,
                wall_s=task.limits.wall_s - WRAP_UP_S,
            )
        finally:
            hidden = _secrets(variables)
            (folder / "stdout.txt").write_text(_plain(course.said, hidden), encoding="utf-8")
            (folder / "stderr.txt").write_text(_plain(course.complained, hidden), encoding="utf-8")
        if course.exit_code == 0 and not listener.n_heard:
            raise LinkError(
                f"{self.program.command[0]} has called no tool.",
                hint="It may not have found the server; see what it said in the folder client.",
            )
        return self._read(course, start, hidden)

    def _read(self, course: _Course, start: Start, hidden: Mapping[str, str]) -> AgentEnd:
        if course.over is not None:
            return AgentEnd(answer=str(course.over), state=TrialState.OUT_OF_BUDGET)
        if course.exit_code is None:
            return AgentEnd(answer="It took too long.", state=TrialState.OUT_OF_BUDGET)
        text = _plain(course.said, hidden)
        if course.exit_code != 0:
            complaint = _plain(course.complained, hidden).strip() or text.strip()
            raise LinkError(
                f"{self.program.command[0]} ended with status {course.exit_code}: "
                f"{complaint[-LAST_WORDS:]}",
                hint="Run it by hand once; it may want a login or other options.",
            )
        said = _read_json(text) if self.program.answer is AnswerForm.JSON else None
        numbers = self.program.find_numbers
        return AgentEnd(
            answer=self._last_words(text, said, start.answer, hidden),
            n_decisions=numbers(said, self.program.turns),
            n_input_tokens=numbers(said, self.program.input_tokens),
            n_output_tokens=numbers(said, self.program.output_tokens),
        )

    def _last_words(self, text: str, said: object, file: Path, hidden: Mapping[str, str]) -> str:
        if self.program.answer is AnswerForm.JSON:
            return self.program.find_answer(said)
        if self.program.answer is AnswerForm.TEXT:
            return text.strip()
        return _plain(file.read_bytes(), hidden).strip() if file.exists() else ""


async def _run(
    command: list[str],
    *,
    start: Start,
    variables: Mapping[str, str],
    listener: Listener,
    course: _Course,
    wall_s: float,
) -> None:
    """Run a program to its end, or until its time or its budget is up; leaves nothing running."""
    process = await anyio.open_process(
        [sys.executable, str(keeper.__file__), *command],
        cwd=start.folder,
        env=dict(variables),
        start_new_session=True,
    )
    try:
        with anyio.move_on_after(wall_s):
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(_collect, process.stdout, course.said)
                tasks.start_soon(_collect, process.stderr, course.complained)
                tasks.start_soon(_listen, listener, course, tasks.cancel_scope)
                course.exit_code = await process.wait()
                tasks.cancel_scope.cancel()
    finally:
        with anyio.CancelScope(shield=True):
            # It forgets itself before it has ended, so it is looked for first.
            servers = _find_servers(start.folder.parent)
            await _end_group(process)
            await _await_end(servers)
            await _take_rest(process, course)
            _hear_rest(listener, course)


async def _collect(stream: ByteReceiveStream | None, into: bytearray) -> None:
    if stream is None:
        return
    async for data in stream:
        into += data
        del into[:-MOST_BYTES]


async def _listen(listener: Listener, course: _Course, scope: anyio.CancelScope) -> None:
    try:
        await listener.listen()
    except OutOfBudgetError as error:
        course.over = error
        scope.cancel()


def _hear_rest(listener: Listener, course: _Course) -> None:
    try:
        listener.hear_new()
    except OutOfBudgetError as error:
        course.over = course.over or error


async def _take_rest(process: Process, course: _Course) -> None:
    """Take what was written last; nobody is left who could write more."""
    with anyio.move_on_after(1.0):
        await _collect(process.stdout, course.said)
        await _collect(process.stderr, course.complained)
    await process.aclose()


def _find_servers(folder: Path) -> tuple[int, ...]:
    """Return the processes of the servers that serve a trial's robot.

    A client program often starts its server as a group of its own.
    """
    numbers = []
    for path in (folder / CONTROL / SERVED).glob("*.json"):
        with suppress(OSError, ValueError, KeyError):
            numbers.append(int(json.loads(path.read_text(encoding="utf-8"))["process"]))
    return tuple(numbers)


async def _await_end(servers: Collection[int]) -> None:
    """Return when servers have ended, or when it has waited long enough.

    One that has lost its client ends by itself, once it has written what it has to write. It is not
    killed: its number was only read from a file.
    """
    with anyio.move_on_after(WRAP_UP_S):
        # Nothing tells when processes that are not our children end.
        while any(map(_is_running, servers)):  # noqa: ASYNC110 - as said
            await anyio.sleep(0.02)


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except OSError:
        return False
    return True


async def _end_group(process: Process) -> None:
    """End a program, and then whatever is left of it, by its own group."""
    if process.returncode is None:
        process.terminate()
    with anyio.move_on_after(GRACE_S):
        # Nothing tells when a group of processes that are not our children is empty.
        while _signal_group(process.pid, 0):  # noqa: ASYNC110 - as said
            await anyio.sleep(0.02)
    _signal_group(process.pid, signal.SIGKILL)
    await process.wait()


def _signal_group(group: int, number: int) -> bool:
    """Send a signal to a group; false when nobody is left in it."""
    try:
        os.killpg(group, number)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def _choose_variables(program: Program) -> dict[str, str]:
    names = (*ALWAYS, *program.environment)
    return {name: os.environ[name] for name in names if name in os.environ}


def _secrets(variables: Mapping[str, str]) -> dict[str, str]:
    """Return the values that must not be written down, and what is written instead."""
    return {
        value: f"[{name}]"
        for name, value in variables.items()
        if name not in ALWAYS and len(value) >= LEAST_SECRET
    }


def _plain(data: bytes | bytearray, hidden: Mapping[str, str]) -> str:
    text = data.decode("utf-8", "replace")
    for value, name in hidden.items():
        text = text.replace(value, name)
    return text


def _read_json(text: str) -> object:
    """Return the JSON object in a text; programs may write lines of their own before it."""
    try:
        return json.loads(text[text.index("{") :])
    except ValueError:
        return None
