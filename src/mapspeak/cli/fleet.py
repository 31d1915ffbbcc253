"""Several robots on one command line: `--robot hall=ws://... --robot yard=ws://...`."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from mapspeak.errors import ConfigError

NAME = re.compile(r"(?P<name>[A-Za-z][A-Za-z0-9_-]{0,39})=(?P<rest>.+)", re.DOTALL)
ONLY = ""
"""The name of a robot that has none, because it is the only one."""


def name_robots(given: Sequence[str]) -> dict[str, str]:
    """Gives the address of each robot by its name; a single one needs no name.

    Raises:
        ConfigError: Several robots, of which not each has a name of its own.
    """
    if len(given) == 1 and NAME.fullmatch(given[0]) is None:
        return {ONLY: given[0]}
    named: dict[str, str] = {}
    for each in given:
        match = NAME.fullmatch(each)
        if match is None:
            from mapspeak.links.rosbridge import quote_address  # noqa: PLC0415 - heavy

            raise ConfigError(
                f"{quote_address(each)} has no name: with several robots each needs one of "
                "letters, digits, _ and - (40 at most).",
                hint="Write --robot hall=ws://192.168.1.20:9090 --robot yard=ws://192.168.1.21:9090.",
            )
        if match["name"] in named:
            raise ConfigError(
                f"Two robots are called {match['name']!r}.", hint="Give each a name of its own."
            )
        named[match["name"]] = match["rest"]
    return named


def split_files(given: Sequence[str], robots: Mapping[str, str], what: str) -> dict[str, Path]:
    """Gives the file of each robot by its name: "NAME=FILE", or "FILE" for those without.

    Args:
        given: As on the command line.
        robots: By name.
        what: The option, for the error.

    Raises:
        ConfigError: There is no robot of that name, or it has two files.
    """
    files: dict[str, Path] = {}
    for each in given:
        match = NAME.fullmatch(each)
        is_named = match is not None and match["name"] in robots
        name, path = (match["name"], match["rest"]) if match and is_named else (ONLY, each)
        if match is not None and not is_named and ONLY not in robots:
            raise ConfigError(
                f"{what}: there is no robot called {match['name']!r}.",
                hint=f"There are: {', '.join(robots)}.",
            )
        if name in files:
            raise ConfigError(
                f"{what} is given twice for {name or 'all robots'}.", hint="Leave one of them away."
            )
        files[name] = Path(path)
    return files


def file_for(name: str, files: Mapping[str, Path]) -> Path | None:
    """Gives a robot's own file, else the one for all, else None."""
    return files.get(name, files.get(ONLY))
