"""The ways of searching that are compared."""

import importlib
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.requests.data import Request, read_maps, things_of
from mapspeak.memory.search.answer import MINILM_THRESHOLDS, Entry, Verdict
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.meaningindex import Embedder, TextVectors, find_model
from mapspeak.memory.search.wordindex import split_words

__all__ = ["FIRST", "Method", "Reply", "list_methods"]

FIRST = 5
"""So many candidates are looked at."""


@dataclass(frozen=True, slots=True)
class Reply:
    """The ids of the candidates, best first, and how far to trust them, where a method says so."""

    ids: Sequence[str]
    verdict: Verdict | None = None


@dataclass(frozen=True, slots=True)
class Method:
    """A way of searching.

    Attributes:
        name: How it is called in the figures.
        ask: Gives its reply to a request.
        embedder: Its model, where it has one.
    """

    name: str
    ask: Callable[[Request], Reply]
    embedder: Embedder | None = None


def list_methods() -> tuple[list[Method], list[str]]:
    """Return the methods that can be run here, and a sentence for each that cannot."""
    methods, missing = [_overlap(), Method("words only", _searching(None))], []
    if find_spec("rapidfuzz"):
        methods.insert(1, _fuzzy())
    else:
        missing.append("rapidfuzz could not be run: it is not installed.")
    wordllama = _find_wordllama()
    if wordllama:
        methods.append(Method("WordLlama", _searching(wordllama), wordllama))
    else:
        missing.append(
            "WordLlama could not be run: wordllama, tokenizers and safetensors are not installed."
        )
    model = find_model()
    if model:
        methods.append(Method("MiniLM", _searching(model), model))
    else:
        missing.append("MiniLM could not be run: mapspeak[semantic] is not installed.")
    return methods, missing


def _searching(embedder: Embedder | None) -> Callable[[Request], Reply]:
    vectors = None if embedder is None else TextVectors(embedder)
    indices = {
        name: EntryIndex(things_of(each), vectors=vectors) for name, each in read_maps().items()
    }

    def ask(request: Request) -> Reply:
        answer = indices[request.building].find(request.words, limit=FIRST)
        return Reply([each.entry.id for each in answer.candidates], answer.verdict)

    return ask


def _overlap() -> Method:
    """Return BM25 (Robertson et al., 1994) over label, purpose and note, words as they stand."""
    scorers = {name: _Bm25(things_of(each)) for name, each in read_maps().items()}
    return Method("word overlap (BM25)", lambda request: scorers[request.building].ask(request))


class _Bm25:
    def __init__(self, entries: Sequence[Entry]) -> None:
        self._entries = entries
        self._counts = [Counter(_words(_own_text(entry))) for entry in entries]
        self._mean_length = sum(map(Counter.total, self._counts)) / len(entries)

    def ask(self, request: Request) -> Reply:
        scores = [
            sum(self._score(word, own) for word in _words(request.words)) for own in self._counts
        ]
        return _best(self._entries, scores)

    def _score(self, word: str, own: Counter[str]) -> float:
        n_with = sum(word in counts for counts in self._counts)
        rarity = math.log1p((len(self._counts) - n_with + 0.5) / (n_with + 0.5))
        length = 0.25 + 0.75 * own.total() / self._mean_length
        return rarity * own[word] * 2.2 / (own[word] + 1.2 * length)


def _fuzzy() -> Method:
    likeness = importlib.import_module("rapidfuzz.fuzz").WRatio
    things: Mapping[str, Sequence[Entry]] = {
        name: things_of(each) for name, each in read_maps().items()
    }

    def ask(request: Request) -> Reply:
        entries, words = things[request.building], request.words.casefold()
        scores = [
            max(likeness(words, text.casefold()) for text in (each.name, _own_text(each)))
            for each in entries
        ]
        return _best(entries, scores)

    return Method("rapidfuzz", ask)


def _best(entries: Sequence[Entry], scores: Sequence[float]) -> Reply:
    said = [number for number, score in enumerate(scores) if score > 0]
    said.sort(key=lambda number: (-scores[number], entries[number].id))
    return Reply([entries[number].id for number in said[:FIRST]])


def _own_text(entry: Entry) -> str:
    return " ".join(filter(None, (entry.name, entry.purpose, entry.note)))


def _words(text: str) -> Iterator[str]:
    return (word for _, word in split_words(text))


def _find_wordllama() -> "_WordLlama | None":
    spec = find_spec("wordllama")
    can_read = spec and find_spec("tokenizers") and find_spec("safetensors")
    folders = (spec.submodule_search_locations or ()) if spec and can_read else ()
    return next((_WordLlama(Path(folder)) for folder in folders), None)


class _WordLlama:
    """The mean of a text's word vectors; read without importing the package."""

    name = "wordllama l2_supercat_256"
    thresholds = replace(MINILM_THRESHOLDS, least_ratio=0.2, same_ratio=0.05)

    def __init__(self, folder: Path) -> None:
        read = importlib.import_module("safetensors.numpy").load_file
        tensors = read(folder / "weights" / "l2_supercat_256.safetensors")
        self._words = tensors["embedding.weight"].astype(np.float32)
        tokenizer = importlib.import_module("tokenizers").Tokenizer
        path = folder / "tokenizers" / "l2_supercat_tokenizer_config.json"
        self._pieces = tokenizer.from_file(str(path))
        self._pieces.no_padding()

    def embed(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """Return one row for each text, a vector of length 1."""
        return np.array([self._embed_one(text) for text in texts], dtype=np.float32)

    def _embed_one(self, text: str) -> NDArray[np.float32]:
        ids = self._pieces.encode(text, add_special_tokens=False).ids
        total = self._words[ids].sum(axis=0)
        result: NDArray[np.float32] = total / max(float(np.linalg.norm(total)), 1e-9)
        return result
