"""The documents tell the truth: examples run, commands exist, links lead somewhere."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click
import pytest

from mapspeak.cli import cli
from mapspeak.cli.commands import COMMANDS

CHECKOUT = Path(__file__).parents[2]
DOCUMENTS = sorted([*CHECKOUT.glob("*.md"), *CHECKOUT.glob("docs/**/*.md")])

BLOCK = re.compile(r"^( *)```(\w+)[^\n]*\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
INLINE_COMMAND = re.compile(r"(?<!`)`((?:\./run|mapspeak) [^`\n]+)`(?!`)")
LINK = re.compile(r"\]\(([^)\s#]+)[^)]*\)")
LINK_TO_HEADING = re.compile(r"\]\(([^)\s#:]*)#([^)\s]+)\)")
HEADING = re.compile(r"^#+ +(.+)$", re.MULTILINE)
PLACE_IN_TREE = re.compile(r"`([a-z_0-9]+(?:/[a-z_0-9]+)+/?|[a-z_0-9]+(?:/|\.py))`")
END_OF_COMMAND = {"|", "||", "&&", "&", ";", ">", "<", "2>"}


def named(document: Path) -> str:
    return str(document.relative_to(CHECKOUT))


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A fenced example of a document."""

    language: str
    text: str
    line: int


def blocks_of(document: Path) -> Iterator[Block]:
    text = document.read_text()
    for match in BLOCK.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        yield Block(language=match[2], text=match[3], line=line)


def command_lines(block: Block) -> Iterator[str]:
    """Finds what a reader would type: in a console after the prompt, in a script every line."""
    lines = block.text.replace("\\\n", " ").splitlines()
    if block.language == "console":
        yield from (line.strip()[2:] for line in lines if line.strip().startswith("$ "))
    elif block.language in {"sh", "bash"}:
        yield from (line.strip() for line in lines)


def words_of(command_line: str) -> list[str]:
    """Splits one command into words, without what it is piped into or follows it."""
    words = shlex.split(command_line, comments=True)
    end = next((n for n, word in enumerate(words) if word in END_OF_COMMAND), len(words))
    return words[:end]


def commands_in_blocks() -> Iterator[tuple[str, list[str]]]:
    """Finds every call of ours in the examples, as its place and its words."""
    for document in DOCUMENTS:
        for block in blocks_of(document):
            for line in command_lines(block):
                if words_of(line)[:1] in (["./run"], ["mapspeak"]):
                    yield f"{named(document)}:{block.line}: {line}", words_of(line)


def commands_in_prose() -> Iterator[tuple[str, list[str]]]:
    """Finds every call of ours between backticks, where a placeholder may stand for arguments."""
    for document in DOCUMENTS:
        for command in INLINE_COMMAND.findall(BLOCK.sub("", document.read_text())):
            yield f"{named(document)}: {command}", words_of(command)


def commands_of_run() -> set[str]:
    """Lists the commands that ./run keeps for itself, from its own help."""
    script = (CHECKOUT / "run").read_text()
    return {"help", *re.findall(r"^  \./run ([\w-]+)", script, re.MULTILINE)} - set(COMMANDS)


def why_not(arguments: list[str]) -> str | None:
    """Reads arguments as the command line does, without doing what they ask."""
    command: click.Command = cli
    context = cli.make_context("mapspeak", [])
    while isinstance(command, click.Group) and arguments and not arguments[0].startswith("-"):
        name, *arguments = arguments
        found = command.get_command(context, name)
        if found is None:
            return f"there is no command {name!r}"
        command = found
    try:
        command.make_context(command.name, arguments, parent=context)
    except click.exceptions.Exit:
        return None  # --help and --version end here
    except click.UsageError as error:
        return error.format_message()
    return None


@pytest.mark.parametrize("document", DOCUMENTS, ids=named)
def test_the_python_examples_run_from_top_to_bottom(
    document: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "example"}
    for block in blocks_of(document):
        if block.language == "python":
            source = "\n" * block.line + block.text
            exec(compile(source, document, "exec"), names)  # noqa: S102 - our own examples


def test_a_command_to_type_is_understood() -> None:
    own = commands_of_run()
    wrong = {}
    for place, (program, *arguments) in commands_in_blocks():
        is_our_scripts = program == "./run" and (not arguments or arguments[0] in own)
        if not is_our_scripts and (reason := why_not(arguments)):
            wrong[place] = reason
    assert wrong == {}


def test_a_command_in_prose_exists() -> None:
    known = {*COMMANDS, *commands_of_run(), "--help", "--version", "..."}
    assert [place for place, words in commands_in_prose() if words[1] not in known] == []


def test_links_to_files_lead_somewhere() -> None:
    assert [
        f"{named(document)}: {target}"
        for document in DOCUMENTS
        for target in LINK.findall(document.read_text())
        if "://" not in target and not (document.parent / target).exists()
    ] == []


def anchors_of(document: Path) -> set[str]:
    """Returns the anchors that a forge makes of the headings."""
    titles = HEADING.findall(document.read_text())
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def test_links_to_headings_lead_somewhere() -> None:
    dead = [
        f"{named(document)}: {path}#{anchor}"
        for document in DOCUMENTS
        for path, anchor in LINK_TO_HEADING.findall(document.read_text())
        if anchor not in anchors_of((document.parent / path) if path else document)
    ]

    assert not dead


def test_what_contributing_says_of_the_tree_is_there() -> None:
    guide = (CHECKOUT / "CONTRIBUTING.md").read_text()
    tree = guide[guide.index("## The tree") : guide.index("## How we write")]
    places = {place.rstrip("/") for place in PLACE_IN_TREE.findall(tree)}
    homes = (CHECKOUT, CHECKOUT / "src/mapspeak", CHECKOUT / "src/mapspeak/server")
    assert [
        place
        for place in sorted(places)
        if not any((home / place).exists() or (home / f"{place}.py").exists() for home in homes)
    ] == []
