"""Words as people write them and as they are compared: small letters, without accents, by stem."""

import re
import unicodedata
from collections.abc import Iterator

__all__ = ["content_stems", "content_words", "split_words", "stem"]

_FILLERS = """
    a an and any are at by can closest could drive find for from get go goto here i in is it its me
    move my navigate near nearest of on or place please robot some take that the there this to was
    we what where which with you your
""".split()  # noqa: SIM905 - fifty words in quotes would hide what they are


_ENDING = re.compile(r"(?<=\w)['\u2019](?:d|ll|m|re|s|t|ve)\b", re.IGNORECASE)
"""What is left of a word in "I'm", "where's" and "won't"."""


def split_words(text: str) -> Iterator[tuple[str, str]]:
    """Gives each word as it stands and as it is compared: small letters without accents."""
    for shown in re.findall(r"\w+", text):
        yield shown, shown.lower() if shown.isascii() else _without_accents(shown)


def _without_accents(word: str) -> str:
    letters = unicodedata.normalize("NFKD", word.casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter))


def content_words(text: str) -> Iterator[tuple[str, str]]:
    """Gives the words that say what is meant, without "the", "where's" and "take me to"."""
    words = list(split_words(_ENDING.sub("", text)))
    for number, (shown, word) in enumerate(words, 1):
        # "Aisle A" is not any aisle.
        tells_apart = len(word) == 1 and 1 < number == len(words)
        if tells_apart or word not in _FILLERS:
            yield shown, word


def content_stems(text: str) -> tuple[str, ...]:
    """Gives the stems of the words that say what is meant."""
    return tuple(stem(word) for _, word in content_words(text))


def stem(word: str) -> str:
    """Cuts an English ending off: plural, -ing, -ed, -er, a last e."""
    if len(word) > 4 and word.endswith("ies"):
        word = word[:-3] + "y"
    elif len(word) > 4 and word.endswith(("ses", "xes", "zes", "ches", "shes")):
        word = word[:-2]
    elif len(word) > 3 and word.endswith("s") and not word.endswith("ss"):
        word = word[:-1]
    for ending, n_left in (("ing", 3), ("ed", 3), ("er", 5)):
        if word.endswith(ending) and len(word) - len(ending) >= n_left:
            word = word.removesuffix(ending)
            return word[:-1] if word[-1] == word[-2] and word[-1] not in "ls" else word
    return word.removesuffix("e") if len(word) > 3 else word
