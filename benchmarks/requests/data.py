"""Reads the memories and the requests."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ruamel.yaml import YAML

from mapspeak.memory import SemanticMap
from mapspeak.memory.search.answer import Entry, EntryKind, list_entries
from mapspeak.memory.store.document import parse_document

__all__ = ["HELD_OUT", "NOTHING", "TUNING", "Request", "read_maps", "read_requests", "things_of"]

_FOLDER = Path(__file__).parent
HELD_OUT = (_FOLDER / "held_out.yaml",)
TUNING = tuple(_FOLDER / name for name in ("tuning.yaml", "tuning_more.yaml", "tuning_absent.yaml"))
NOTHING = "nothing"
"""The kind of a request for what is not remembered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What somebody asks for.

    Attributes:
        building: Whose memory is asked.
        words: As the person says it.
        kind: How it is said.
        answers: The ids of all things that are right.
    """

    building: str
    words: str
    kind: str
    answers: frozenset[str]


def read_requests(paths: Sequence[Path]) -> list[Request]:
    """Read files of requests."""
    return [
        Request(
            building=each["building"],
            words=each["request"],
            kind=each["kind"],
            answers=frozenset(answer.casefold() for answer in each["answers"] or ()),
        )
        for path in paths
        for each in YAML(typ="safe").load(path)
    ]


@cache
def read_maps() -> Mapping[str, SemanticMap]:
    """Read the memory of each building."""
    return {
        path.stem: parse_document(path.read_bytes(), source=path.name).places
        for path in sorted((_FOLDER / "buildings").glob("*.yaml"))
    }


def things_of(semantic_map: SemanticMap) -> Sequence[Entry]:
    """Return what the answers are chosen from: things, not places."""
    return [entry for entry in list_entries(semantic_map) if entry.kind is EntryKind.THING]
