"""What a client is told of the tools: only of those that it is offered."""

import re
from collections.abc import Collection

from mapspeak.server.prompts import read_text

__all__ = ["keep_offered", "write_instructions"]

SENTENCES = re.compile(r"(?<=[.!?])\s+")
CLAUSE = "; "


def write_instructions(offered: Collection[str], *, known: Collection[str], moves: bool) -> str:
    """Gives what a model reads before its first call.

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
    """Gives a description without the clauses that name missing tools; its first clause stays."""
    paragraphs = text.split("\n")
    return "\n".join(
        kept
        for number, paragraph in enumerate(paragraphs)
        if (kept := _keep(paragraph, missing, keeps_first=number == 0))
    )


def _keep_line(line: str, missing: Collection[str]) -> str:
    """Gives a line of the instructions; empty where what it is about is missing."""
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
    """Gives clauses as a sentence of their own; a tool's name is written as it is."""
    first = text.split(maxsplit=1)[0]
    begun = text if "_" in first or "." in first else f"{text[:1].upper()}{text[1:]}"
    return begun if begun.endswith((".", "!", "?")) else f"{begun}."


def _names(text: str, missing: Collection[str]) -> bool:
    return any(word in missing for word in re.findall(r"\w+", text))
