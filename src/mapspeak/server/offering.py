"""What a client is told of the tools: only of those that it is offered."""

import json
import re
from collections.abc import Callable, Collection
from functools import partial
from typing import Any

from mcp_types import CallToolResult, TextContent

from mapspeak.server.prompts import read_text

SENTENCES = re.compile(r"(?<=[.!?])\s+")
CLAUSE = "; "
PARTS = re.compile(r"(; |, or |: )")
QUOTED = re.compile(r"\"[^\"]*\"|(?<!\w)'[^']*'(?!\w)")
ADVISING = frozenset(("advice", "next_step", "problem", "reason", "warnings"))
"""Fields of reports that hold what the server says itself, and may name a tool."""


def write_instructions(offered: Collection[str], *, known: Collection[str], moves: bool) -> str:
    """Return what a model reads before its first call.

    Args:
        offered: The names of the tools that can be called.
        known: Those of all tools there are.
        moves: Some tool moves or changes the robot.
    """
    missing = set(known) - set(offered)
    lines = [_keep_line(line, missing) for line in read_text("instructions").splitlines()]
    if not moves:
        lines.insert(1, "Nothing here moves or changes the robot.")
    return "\n".join(line for line in lines if line)


def keep_offered(text: str, missing: Collection[str]) -> str:
    """Return a description without the clauses that name missing tools; its first clause stays."""
    paragraphs = text.split("\n")
    return "\n".join(
        kept
        for number, paragraph in enumerate(paragraphs)
        if (kept := _keep(paragraph, missing, keeps_first=number == 0))
    )


def _keep_line(line: str, missing: Collection[str]) -> str:
    """Return a line of the instructions; empty where what it is about is missing."""
    lead = SENTENCES.split(line)[0].split(CLAUSE)[0]
    return "" if _names(lead, missing) else _keep(line, missing)


def _keep(text: str, missing: Collection[str], *, keeps_first: bool = False) -> str:
    kept: list[str] = []
    for number, sentence in enumerate(SENTENCES.split(text)):
        clauses = [
            clause
            for at, clause in enumerate(sentence.split(CLAUSE))
            if not _names(clause, missing) or (keeps_first and number == at == 0)
        ]
        if clauses:
            said = CLAUSE.join(clauses)
            kept.append(said if said == sentence else _as_sentence(said))
    return " ".join(kept)


def _as_sentence(text: str) -> str:
    """Return clauses as a sentence of their own; a tool's name is written as it is."""
    first = text.split(maxsplit=1)[0]
    begun = text if "_" in first or "." in first else f"{text[:1].upper()}{text[1:]}"
    return begun if begun.endswith((".", "!", "?")) else f"{begun}."


def _names(text: str, missing: Collection[str]) -> bool:
    return any(word in missing for word in re.findall(r"\w+", text))


def tell_offered(text: str, missing: Collection[str]) -> str:
    """Return what is said to a model, without the parts of sentences that lead to missing tools.

    What stands in quotes is what somebody else said, and names no tool. Tools that are called by
    a common word, such as turn, are not looked for.
    """
    names = {name for name in missing if "_" in name}
    lines = text.split("\n")
    told = [_tell_line(line, names) if _leads_to(line, names) else line for line in lines]
    return "\n".join(new for new, line in zip(told, lines, strict=True) if new or not line)


def tell_offered_in(answer: CallToolResult, missing: Collection[str]) -> CallToolResult:
    """Return a tool's answer likewise; of a report only the fields that advise."""
    report = answer.structured_content
    if report is None:
        return _with_texts(answer, partial(tell_offered, missing=missing))
    changed: dict[str, str] = {}
    told = {
        key: _tell_field(value, missing, changed) if key in ADVISING else value
        for key, value in report.items()
    }
    if not changed:
        return answer

    def rewrite(text: str) -> str:
        for before, after in changed.items():
            text = text.replace(_as_json(before), _as_json(after))
        return text

    return _with_texts(answer.model_copy(update={"structured_content": told}), rewrite)


def _tell_field(value: Any, missing: Collection[str], changed: dict[str, str]) -> Any:  # noqa: ANN401 - JSON of any shape
    if isinstance(value, list):
        return [_tell_field(each, missing, changed) for each in value]
    if not isinstance(value, str):
        return value
    told = tell_offered(value, missing)
    if told != value:
        changed[value] = told
    return told


def _with_texts(answer: CallToolResult, change: Callable[[str], str]) -> CallToolResult:
    content = [
        part.model_copy(update={"text": change(part.text)})
        if isinstance(part, TextContent)
        else part
        for part in answer.content
    ]
    return answer.model_copy(update={"content": content})


def _tell_line(line: str, names: Collection[str]) -> str:
    """Return a line without the parts that lead to tools; quotes are taken out for so long."""
    quotes: list[str] = []

    def set_aside(found: re.Match[str]) -> str:
        quotes.append(found[0])
        return f"\0{len(quotes) - 1}\0"

    plain = QUOTED.sub(set_aside, line)
    kept = [_tell_sentence(each, names) for each in SENTENCES.split(plain)]
    return re.sub(r"\0(\d+)\0", lambda found: quotes[int(found[1])], " ".join(filter(None, kept)))


def _tell_sentence(sentence: str, names: Collection[str]) -> str:
    if not _leads_to(sentence, names):
        return sentence
    first, *others = PARTS.split(sentence)
    parts = [("", first), *zip(others[::2], others[1::2], strict=True)]
    kept = [(joint, part) for joint, part in parts if not _leads_to(part, names)]
    if not kept:
        return ""
    (_, begun), *rest = kept
    return _as_sentence(begun + "".join(joint + part for joint, part in rest))


def _leads_to(text: str, names: Collection[str]) -> bool:
    """Return True where a tool is named outside of quotes, and not as a part of a path."""
    own = QUOTED.sub(" ", text)
    return any(word in names for word in re.findall(r"(?<![\w/])\w+(?![\w/])", own))


def _as_json(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)[1:-1]
