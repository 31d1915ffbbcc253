from pathlib import Path

import numpy as np
import pytest

from embedding import shipped_model
from mapspeak.errors import ConfigError
from mapspeak.memory.search.meaningindex import Embedder

TEXTS = ["ladder", "sink", "something to reach the top shelf", "anvil", "a much longer text, that"]


@pytest.fixture(scope="module")
def model() -> Embedder:
    return shipped_model()


def test_each_text_gives_a_vector_of_length_one(model: Embedder) -> None:
    vectors = model.embed(TEXTS)

    assert vectors.shape == (len(TEXTS), 384)
    assert np.linalg.norm(vectors, axis=1) == pytest.approx([1.0] * len(TEXTS), abs=1e-5)


def test_no_text_gives_no_vector(model: Embedder) -> None:
    assert model.embed([]).shape == (0, 384)


def test_a_text_has_the_same_vector_whatever_it_is_asked_together_with(model: Embedder) -> None:
    texts = [f"{text} {number}" for number in range(40) for text in TEXTS]

    together = model.embed(texts)

    alone = [model.embed([text])[0].tolist() for text in texts]
    assert together.tolist() == alone


def test_a_text_of_which_no_piece_is_known_is_like_nothing(model: Embedder) -> None:
    assert not model.embed(["", "\U0001f9ef"]).any()


def test_a_text_of_any_length_has_a_vector_of_its_beginning(model: Embedder) -> None:
    long, longer = (model.embed(["ladder " * n_words])[0] for n_words in (300, 400))

    assert long.tolist() == longer.tolist()


@pytest.mark.parametrize("content", [b"", b"\x3a\x05hello", b"no model", b"\xff" * 99])
def test_a_file_that_is_no_model_is_refused(content: bytes, tmp_path: Path) -> None:
    from mapspeak.memory.search.minilm import MiniLM  # noqa: PLC0415 - optional

    path = tmp_path / "model.onnx"
    path.write_bytes(content)

    with pytest.raises(ConfigError, match=r"model.onnx does not hold the model"):
        MiniLM(path)


def test_the_rounded_model_gives_the_likenesses_of_the_whole_one(model: Embedder) -> None:
    first, *others = model.embed(
        [
            "That is a happy person",
            "That is a happy dog",
            "That is a very happy person",
            "Today is a sunny day",
        ]
    )

    likenesses = [float(first @ other) for other in others]
    assert likenesses == pytest.approx([0.695, 0.943, 0.257], abs=0.01)


def test_the_model_tells_what_is_meant(model: Embedder) -> None:
    things = ["ladder", "washbasin", "fire extinguisher"]
    asked = ["something to reach the top shelf", "where can I wash my hands?", "put out a blaze"]

    likeness = model.embed(asked) @ model.embed(things).T

    assert [things[column] for column in likeness.argmax(axis=1)] == things
