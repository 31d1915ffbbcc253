"""Whether two labels may be words for one thing, by the words alone."""

import re
import unicodedata
from functools import lru_cache

__all__ = ["name_the_same"]

_LOOKS = frozenset(
    """
    a an another big black blue brown dark fixed front green grey gray large left light little long
    main metal mounted new old one orange other pink purple red right round second short silver
    small some tall the third two wall white wooden yellow
    """.split()  # noqa: SIM905 - forty words in quotes would hide what they are
)
"""Words for how a thing looks or stands: one observer says them, the next does not."""


def name_the_same(label: str, other: str) -> bool:
    """True when one label says no more than the other leaves open, and both end in one noun.

    "extinguisher", "red extinguisher" and "fire extinguishers" name the same; "coffee machine" and
    "washing machine" do not, though "machine" may be either.
    """
    words, others = _words_of(label), _words_of(other)
    return words[-1] == others[-1] and (set(words) <= set(others) or set(others) <= set(words))


@lru_cache(maxsize=4096)
def _words_of(label: str) -> tuple[str, ...]:
    letters = unicodedata.normalize("NFKD", label.casefold())
    plain = "".join(c for c in letters if not unicodedata.combining(c))
    # A place or a detail after the noun, as in "sink with a mirror", does not change the noun.
    head = re.split(r"\b(?:with|on|in|at|near|under|behind|beside|for|of)\b|[,(;]", plain)[0]
    words = [_singular(word) for word in re.findall(r"[^\W\d_]+", head) or [plain.strip()]]
    return tuple(word for word in words if word not in _LOOKS) or tuple(words)


def _singular(word: str) -> str:
    if len(word) > 4 and word.endswith(("ses", "xes", "zes", "ches", "shes")):
        return word[:-2]
    if len(word) > 4 and word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-1] if len(word) > 3 and word.endswith("s") and word[-2] not in "su" else word
