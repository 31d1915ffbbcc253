"""The command agent: a client program with the server configured, judged by the server's log."""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import anyio
from anyio.abc import ByteReceiveStream, Process

from mapspeak.errors import LinkError
from mapspeak.evaluation.agent import (
    AgentEnd,
    Assignment,
    OutOfBudgetError,
    Picture,
    ToolAnswer,
    ToolClient,
    Witness,
)
from mapspeak.evaluation.agents.command import keeper
from mapspeak.evaluation.agents.command.program import ALWAYS, ANSWER, Program
from mapspeak.evaluation.agents.models.chat import Thinking
from mapspeak.evaluation.trials import CALLS, TrialState

EVERY_S = 0.1
MOST_BYTES = 4_000_000
"""Limit of the kept output of a program; only its end is kept."""
WRAP_UP_S = 10.0
"""A program is ended this long before its time is up, so that its server can write the map."""
CONTROL, SERVED = "control", "served"
"""Where in a trial's folder servers write down that they serve."""
GRACE_S = 5.0
LAST_WORDS = 500
LEAST_SECRET = 6
"""Characters; shorter values are no secrets, and would be struck out all over the text."""


@dataclass(slots=True)
class ProgramRun:
    """One run of a program: what it writes, and the calls in the growing log of its server.

    Attributes:
        log: The server's call log; it may not be there yet.
        over: Reason why the witness refused further calls.
        n_heard: Number of calls so far.
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
                # They end by themselves once they have written all they have to write, and are
                # not killed: their numbers were only read from files.
                await _await_gone(os.kill, servers, within_s=WRAP_UP_S)
                # The last lines: no process is left to write more.
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


async def run_program(
    program: Program, thinking: Thinking | None, task: Assignment, tools: ToolClient
) -> AgentEnd:
    """Let a program carry out an assignment, in a folder of the trial.

    Its variables are passed by name, never written.

    Args:
        thinking: How much it may think; None for as it likes.

    Raises:
        LinkError: The program failed by itself.
    """
    folder, log = task.folder / "client", task.folder / f"{CALLS}.jsonl"
    server, answer = task.server, folder / ANSWER
    folder.mkdir(parents=True, exist_ok=True)
    program.write_config(server, folder)
    log.unlink(missing_ok=True)
    answer.unlink(missing_ok=True)
    prompt = "\n\n".join(filter(None, (task.system, task.prompt)))
    command = program.command_line(prompt=prompt, server=server, folder=folder, thinking=thinking)
    names = (*ALWAYS, *program.environment)
    variables = {name: os.environ[name] for name in names if name in os.environ}
    run, wall_s = ProgramRun(log, tools.witness), task.limits.wall_s - WRAP_UP_S
    try:
        settings = {**variables, **program.settings}
        await run.carry_out(command, folder=folder, variables=settings, wall_s=wall_s)
    finally:
        said, complained = _plain(run.said, variables), _plain(run.complained, variables)
        (folder / "stdout.txt").write_text(said, encoding="utf-8")
        (folder / "stderr.txt").write_text(complained, encoding="utf-8")
    if run.over is not None or run.exit_code is None:
        why = "It took too long." if run.over is None else str(run.over)
        return AgentEnd(answer=why, state=TrialState.OUT_OF_BUDGET)
    if run.exit_code != 0:
        complaint = (complained.strip() or said.strip())[-LAST_WORDS:]
        raise LinkError(
            f"{program.command[0]} ended with status {run.exit_code}: {complaint}",
            hint="Run it by hand once; it may want a login or other options.",
        )
    if not run.n_heard:
        raise LinkError(
            f"{program.command[0]} has called no tool.",
            hint="It may not have found the server; see what it said in the folder client.",
        )
    last_words = answer.read_bytes() if answer.exists() else b""
    return program.read_end(said, _plain(last_words, variables))


def _find_servers(folder: Path) -> tuple[int, ...]:
    """Return the server processes of a trial's robot.

    A client program often starts its server as a group of its own.
    """
    numbers = []
    for path in (folder / CONTROL / SERVED).glob("*.json"):
        with suppress(OSError, ValueError, KeyError):
            numbers.append(int(json.loads(path.read_text(encoding="utf-8"))["process"]))
    return tuple(numbers)


async def _end_group(process: Process) -> None:
    """End a program, and then whatever is left of it, by its own group."""
    if process.returncode is None:
        process.terminate()
    await _await_gone(os.killpg, [process.pid], within_s=GRACE_S)
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    await process.wait()


async def _await_gone(
    send: Callable[[int, int], None], numbers: Iterable[int], *, within_s: float
) -> None:
    """Return when processes or groups have ended, or when it has waited long enough.

    Args:
        send: Sends a signal to one of them; signal 0 only asks whether it is there.
    """
    with anyio.move_on_after(within_s):
        for number in numbers:
            with suppress(OSError):
                while True:  # nothing tells when processes that are not our children end
                    send(number, 0)
                    await anyio.sleep(0.02)


def _plain(data: bytes | bytearray, variables: Mapping[str, str]) -> str:
    """Return what was written as text, in which names of variables stand for their secrets."""
    text = data.decode("utf-8", "replace")
    for name, value in variables.items():
        if name not in ALWAYS and len(value) >= LEAST_SECRET:
            text = text.replace(value, f"[{name}]")
    return text
