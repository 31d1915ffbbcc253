"""Compares texts by what they mean, with a model that a package brings along."""

from mapspeak.semantic.retrieval.meaning.finding import find_model
from mapspeak.semantic.retrieval.meaning.wordpieces import is_word

__all__ = ["find_model", "is_word"]
