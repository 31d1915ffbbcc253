"""Client programs as data, ours in the files beside this one: how each is started and read."""

import json
import os
import re
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from mapspeak.errors import ConfigError
from mapspeak.evaluation.agent import AgentEnd
from mapspeak.evaluation.agents.models.chat import Thinking
from mapspeak.settings import read_settings

ANSWER = "answer.txt"
"""The file for last words."""
SERVER = "robot"
"""Name of the server in the programs' own settings."""
ALWAYS = ("PATH", "HOME", "USER", "LANG", "TMPDIR")
"""Variables every program gets: they hold no secrets, and logins are found by them."""
VERSION_WITHIN_S = 20.0
LONGEST_VERSION = 80
"""Characters of a version that are kept."""


class AnswerForm(StrEnum):
    """Where a program leaves its last words."""

    TEXT = "text"
    """All that it writes to standard output."""
    JSON = "json"
    """Under a key of the JSON object on standard output."""
    FILE = "file"
    """In the file named by {answer}."""


class Program(BaseModel):
    """Description of a client program that works without a person.

    In `command` and `thinking`, {prompt}, {config}, {folder}, {answer}, {thinking}, {server} (the
    server's program, quoted) and {arguments} (its arguments as a JSON list) are filled in.

    Attributes:
        thinking: Further arguments if a level of thinking is set; empty if not supported.
        config: File in its folder that names the server, in the usual `mcpServers` JSON.
        server: Further fields of the server in that JSON.
        environment: Names of variables that are passed on, besides PATH, HOME, USER, LANG, TMPDIR.
        settings: Environment variables to set, with their values.
        answer: Where it writes its final answer.
        answer_key: Key of the answer, for JSON; parts are joined by dots, * is any key.
        input_tokens: Keys whose numbers sum to the input tokens, for JSON.
        output_tokens: The same for output tokens.
        turns: The same for requests to the model.
        version: Option that prints its version; empty without one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    command: tuple[str, ...] = ()
    thinking: tuple[str, ...] = ()
    config: str = "mcp.json"
    server: dict[str, Any] = {}
    environment: tuple[str, ...] = ()
    settings: dict[str, str] = {}
    answer: AnswerForm = AnswerForm.TEXT
    answer_key: str = "result"
    input_tokens: tuple[str, ...] = ()
    output_tokens: tuple[str, ...] = ()
    turns: tuple[str, ...] = ()
    version: tuple[str, ...] = ("--version",)

    def find_version(self) -> str | None:
        """Return the first line that it says of its version; None where it says none in time."""
        path = shutil.which(self.command[0]) if self.command and self.version else None
        if path is None:
            return None
        variables = {name: os.environ[name] for name in ALWAYS if name in os.environ}
        try:
            said = subprocess.run(  # noqa: S603 - the user's own
                [path, *self.version],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=variables,
                timeout=VERSION_WITHIN_S,
                check=False,
            ).stdout
        except (OSError, subprocess.TimeoutExpired):
            return None
        lines = said.decode("utf-8", "replace").strip().splitlines()
        return lines[0][:LONGEST_VERSION] if lines else None

    def check(self, thinking: Thinking | None) -> None:
        """Return when the program is there and can be told how much to think.

        Raises:
            ConfigError: It is not, or it cannot.
        """
        if not self.command:
            raise ConfigError("The program has no command.", hint="Write `command: [...]`.")
        if shutil.which(self.command[0]) is None:
            raise ConfigError(
                f"There is no program {self.command[0]!r}.", hint="Install it, and log in with it."
            )
        if thinking is not None and not self.thinking:
            raise ConfigError(
                f"{self.command[0]} cannot be told how much to think.",
                hint="Leave --thinking away, or describe the program with `thinking: [...]`.",
            )

    def command_line(
        self, *, prompt: str, server: Sequence[str], folder: Path, thinking: Thinking | None
    ) -> list[str]:
        """Return what to start in a folder, with the server's own command line."""
        values = {
            "{prompt}": prompt,
            "{config}": str(folder / self.config),
            "{folder}": str(folder),
            "{answer}": str(folder / ANSWER),
            "{thinking}": thinking or "",
            "{server}": json.dumps(server[0]),
            "{arguments}": json.dumps(server[1:]),
        }
        # In one go: what is filled in is not searched for more to fill in.
        places = re.compile("|".join(map(re.escape, values)))
        parts = (*self.command, *(() if thinking is None else self.thinking))
        return [places.sub(lambda found: values[found[0]], part) for part in parts]

    def write_config(self, server: Sequence[str], folder: Path) -> None:
        """Write the program's settings, which name the server."""
        command, *arguments = server
        entry = {"command": command, "args": arguments, **self.server}
        path = folder / self.config
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"mcpServers": {SERVER: entry}}, indent=2), encoding="utf-8")

    def read_end(self, said: str, last_words: str) -> AgentEnd:
        """Return its answer, and what it tells of its cost.

        Args:
            said: All that it wrote to standard output.
            last_words: What the file for them has.
        """
        told: object = None
        answer = (last_words if self.answer is AnswerForm.FILE else said).strip()
        if self.answer is AnswerForm.JSON:
            with suppress(ValueError):
                # Programs may write lines of their own before it.
                told = json.loads(said[said.index("{") :])
            answer = next(map(str, _find(told, self.answer_key)), "")
        return AgentEnd(
            answer=answer,
            n_decisions=_find_sum(told, self.turns),
            n_input_tokens=_find_sum(told, self.input_tokens),
            n_output_tokens=_find_sum(told, self.output_tokens),
        )


def find_program(name: str) -> Program:
    """Return a program by its name, or from a file (.yaml) that describes it.

    Raises:
        ConfigError: There is no such program, or the file has a mistake.
    """
    known = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.yaml"))}
    path = known.get(name, Path(name))
    if path.suffix in {".yaml", ".yml"}:
        return read_settings(
            path, Program, name="the program's file", advice="See the guide to evaluations."
        )
    raise ConfigError(
        f"There is no client program {name[:80]!r}.",
        hint=f"Choose from {', '.join(known)}, or give a .yaml file that describes one.",
    )


def _find_sum(told: object, keys: Iterable[str]) -> int | None:
    """Return the sum of the numbers under some keys; None without any."""
    found = [each for key in keys for each in _find(told, key)]
    numbers = [each for each in found if isinstance(each, int | float)]
    return int(sum(numbers)) if numbers else None


def _find(told: object, key: str) -> Iterator[object]:
    """Yield what lies under a key whose parts are joined by dots; * is any key."""
    if not key:
        yield told
    elif isinstance(told, dict):
        first, _, others = key.partition(".")
        for value in told.values() if first == "*" else [told[first]] if first in told else []:
            yield from _find(value, others)
