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
class ProgramRun:
    """One run of a program: what it writes, and the calls in the growing log of its server.

    Attributes:
        log: The server's call log; it may not be there yet.
        over: Why the witness let no more calls be made.
        n_heard: Calls so far.
    """

    log: Path
    witness: Witness
    said: bytearray = field(default_factory=bytearray)
    complained: bytearray = field(default_factory=bytearray)
    exit_code: int | None = None
    over: OutOfBudgetError | None = None
    n_heard: int = 0
    _n_read: int = 0

    async def carry_out(
        self, command: list[str], *, folder: Path, variables: Mapping[str, str], wall_s: float
    ) -> None:
        """Run a program to its end, or until time or budget is up; leave nothing running."""
        process = await anyio.open_process(
            [sys.executable, str(keeper.__file__), *command],
            cwd=folder,
            env=dict(variables),
            start_new_session=True,
        )
        try:
            with anyio.move_on_after(wall_s):
                async with anyio.create_task_group() as tasks:
                    tasks.start_soon(_collect, process.stdout, self.said)
                    tasks.start_soon(_collect, process.stderr, self.complained)
                    tasks.start_soon(self._listen, tasks.cancel_scope)
                    self.exit_code = await process.wait()
                    tasks.cancel_scope.cancel()
        finally:
            with anyio.CancelScope(shield=True):
                # It forgets itself before it has ended, so it is looked for first.
                servers = _find_servers(folder.parent)
                await _end_group(process)
                await _await_end(servers)
                # What was written last: nobody is left who could write more.
                with anyio.move_on_after(1.0):
                    await _collect(process.stdout, self.said)
                    await _collect(process.stderr, self.complained)
                await process.aclose()
                self._hear_new()

    async def _listen(self, scope: anyio.CancelScope) -> None:
        while self.over is None:
            self._hear_new()
            # A file has no event that every system would tell us of.
            await anyio.sleep(EVERY_S)
        scope.cancel()

    def _hear_new(self) -> None:
        """Tell the witness of every whole line that was not there before."""
        if not self.log.exists():
            return
        with self.log.open("rb") as file:
            file.seek(self._n_read)
            lines = file.read().rpartition(b"\n")[0]
        try:
            for line in lines.split(b"\n") if lines else ():
                self._n_read += len(line) + 1
                self.n_heard += 1
                self._tell(json.loads(line))
        except OutOfBudgetError as error:
            self.over = self.over or error

    def _tell(self, line: dict[str, Any]) -> None:
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


async def _collect(stream: ByteReceiveStream | None, into: bytearray) -> None:
    if stream is None:
        return
    async for data in stream:
        into += data
        del into[:-MOST_BYTES]


@dataclass(frozen=True, slots=True)
class CommandAgent:
    """Runs a program in a folder of the trial; its variables are passed by name, never written.

    Attributes:
        thinking: How much it may think; None for as it likes.
    """

    program: Program
    name: str
    thinking: Thinking | None = None
    connection: ServerAccess = field(default=ServerAccess.COMMAND, kw_only=True)

    def check(self) -> None:
        """Check that the program is there.

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
        run, variables = ProgramRun(log, tools.witness), _choose_variables(self.program)
        hidden = _secrets(variables)
        try:
            await run.carry_out(
                start.command(self.program),
                folder=folder,
                variables={**variables, **self.program.settings},
                wall_s=task.limits.wall_s - WRAP_UP_S,
            )
        finally:
            said, complained = _plain(run.said, hidden), _plain(run.complained, hidden)
            (folder / "stdout.txt").write_text(said, encoding="utf-8")
            (folder / "stderr.txt").write_text(complained, encoding="utf-8")
        if run.over is not None:
            return AgentEnd(answer=str(run.over), state=TrialState.OUT_OF_BUDGET)
        if run.exit_code is None:
            return AgentEnd(answer="It took too long.", state=TrialState.OUT_OF_BUDGET)
        self._check_end(run, complained.strip() or said.strip())
        return self._read(said, start.answer, hidden)

    def _check_end(self, run: ProgramRun, complaint: str) -> None:
        name = self.program.command[0]
        if run.exit_code != 0:
            raise LinkError(
                f"{name} ended with status {run.exit_code}: {complaint[-LAST_WORDS:]}",
                hint="Run it by hand once; it may want a login or other options.",
            )
        if not run.n_heard:
            raise LinkError(
                f"{name} has called no tool.",
                hint="It may not have found the server; see what it said in the folder client.",
            )

    def _read(self, text: str, file: Path, hidden: Mapping[str, str]) -> AgentEnd:
        program, said = self.program, None
        if program.answer is AnswerForm.JSON:
            said = _read_json(text)
            answer = program.find_answer(said)
        elif program.answer is AnswerForm.TEXT:
            answer = text.strip()
        else:
            answer = _plain(file.read_bytes(), hidden).strip() if file.exists() else ""
        return AgentEnd(
            answer=answer,
            n_decisions=program.find_numbers(said, program.turns),
            n_input_tokens=program.find_numbers(said, program.input_tokens),
            n_output_tokens=program.find_numbers(said, program.output_tokens),
        )


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
