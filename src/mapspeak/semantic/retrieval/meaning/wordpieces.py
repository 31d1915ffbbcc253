"""The words and pieces of words that BERT-like models know.

The list beside this file, one piece a line, is the vocabulary of BERT base uncased (Google; its
licence stands beside it). It is also the list of words that are not misspelt.
"""

from functools import cache
from importlib import resources

__all__ = ["is_word", "read_wordpieces"]


@cache
def read_wordpieces() -> tuple[str, ...]:
    """Reads the pieces in the order of their numbers, once: nothing ever changes them."""
    text = resources.files(__package__).joinpath("wordpieces.txt").read_text(encoding="utf-8")
    return tuple(text.split("\n")[:-1])


def is_word(word: str) -> bool:
    """Whether a word in small letters without accents is one of the pieces as a whole."""
    return word in _all_pieces()


@cache
def _all_pieces() -> frozenset[str]:
    return frozenset(read_wordpieces())
