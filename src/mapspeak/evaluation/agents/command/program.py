"""Client programs as data, ours in the files beside this one: how each is started and read."""

import json
import os
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.models.chat import Thinking
from mapspeak.settings import read_settings

SERVER = "robot"
"""What the server is called in the programs' own settings."""
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
    """A client program that works without a person, as data.

    In `command` and `thinking`, {prompt}, {config}, {folder}, {answer}, {thinking}, {server} (the
    server's program, quoted) and {arguments} (its arguments as a JSON list) are filled in.

    Attributes:
        command: The program and its arguments.
        thinking: What follows them where it is said how much to think; empty where it cannot be.
        config: Where in its folder the server is named, in the usual `mcpServers` JSON.
        server: What else that JSON says about the server.
        environment: Names of variables that are passed on, besides PATH, HOME, USER, LANG, TMPDIR.
        settings: Variables that are set for it, with their values.
        answer: Where it leaves its last words.
        answer_key: Their key, for JSON; parts are joined by dots, * is any key.
        input_tokens: Keys whose numbers together are the tokens read, for JSON.
        output_tokens: The same for those written.
        turns: The same for times that the model was asked.
        version: What it is called with to say its version; empty where it has no such option.
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

    def find_numbers(self, said: object, keys: Iterable[str]) -> int | None:
        """Return the sum of the numbers under some keys; None where there is none."""
        found = [each for key in keys for each in _find(said, key.split("."))]
        numbers = [each for each in found if isinstance(each, int | float)]
        return int(sum(numbers)) if numbers else None

    def find_answer(self, said: object) -> str:
        """Return the text under the answer's key; empty where there is none."""
        return next((str(each) for each in _find(said, self.answer_key.split("."))), "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """What one run of a program is started with: the server is a command line."""

    prompt: str
    server: tuple[str, ...]
    folder: Path
    thinking: Thinking | None

    @property
    def answer(self) -> Path:
        """The file for last words."""
        return self.folder / "answer.txt"

    def command(self, program: Program) -> list[str]:
        """Return the program's command line."""
        values = {
            "{prompt}": self.prompt,
            "{config}": str(self.folder / program.config),
            "{folder}": str(self.folder),
            "{answer}": str(self.answer),
            "{thinking}": self.thinking or "",
            "{server}": json.dumps(self.server[0]),
            "{arguments}": json.dumps(self.server[1:]),
        }
        more = () if self.thinking is None else program.thinking
        return [_fill(part, values) for part in (*program.command, *more)]

    def write_config(self, program: Program) -> None:
        """Write the program's settings, which name the server."""
        command, *arguments = self.server
        entry = {"command": command, "args": arguments, **program.server}
        path = self.folder / program.config
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"mcpServers": {SERVER: entry}}, indent=2), encoding="utf-8")


def find_program(name: str) -> Program:
    """Return a program by its name, or from a file (.yaml) that describes it.

    Raises:
        ConfigError: There is none, or the file has a mistake.
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


def _fill(text: str, values: Mapping[str, str]) -> str:
    """Fill in what is to be filled in; the value of one is not searched for another."""
    name = next((name for name in values if name in text), None)
    if name is None:
        return text
    before, _, after = text.partition(name)
    return f"{_fill(before, values)}{values[name]}{_fill(after, values)}"


def _find(said: object, keys: list[str]) -> Iterator[object]:
    if not keys:
        yield said
    elif isinstance(said, dict):
        first, *others = keys
        for value in said.values() if first == "*" else [said[first]] if first in said else []:
            yield from _find(value, others)
