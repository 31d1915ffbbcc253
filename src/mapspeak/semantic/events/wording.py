"""The words of an event: whether they give orders, and how they are told to whoever reads them.

A file may be shared or written by hand, and whatever it says is told beside what the server says
itself: words are quoted, and those that give orders are left out.
"""

import re

from mapspeak.semantic.filtering import tells_what_to_do
from mapspeak.semantic.quoting import quote

__all__ = ["gives_orders", "tell_place", "tell_source", "tell_text"]

_WAYS = re.compile(
    r"^ *(?:please )?(?:avoid|keep|stay|slow|(?:do not|don't) (?:enter|use|cross|pass|block))\b",
    re.IGNORECASE | re.MULTILINE,
)
"""How people tell others of a way that is closed or slow: that is what an event is for."""
_QUOTE_SIGN = re.compile(
    "[\"«»\u2039\u203a\u201a-\u201f]|(?<!\\w)['\u2018\u2019]|['\u2018\u2019](?!\\w)"
)
_NUMBER = r"-?\d+(?:\.\d+)?"
_OWN_PLACE = re.compile(rf"(?:{_NUMBER} m around )?(?:[RCODFPT]\d+|{_NUMBER}, ?{_NUMBER})")
"""A place by an id or in metres says nothing of its own."""


def gives_orders(text: str) -> bool:
    """True for words of an event that tell their reader what to do; quotes hide none of them."""
    # An order may stand within one pair of quotes, and it may go on behind them.
    return any(tells_what_to_do(_WAYS.sub("", _QUOTE_SIGN.sub(by, text))) for by in (" ", "\n"))


def tell_text(text: str) -> str:
    """Gives what is the matter as an observation: `"painters at work"`."""
    return "(its text gives orders and is left out)" if gives_orders(text) else quote(text)


def tell_place(place: str) -> str:
    """Gives where it is: an id or a point as it is, other words quoted."""
    if _OWN_PLACE.fullmatch(place):
        return place
    return "its place gives orders and is left out" if gives_orders(place) else quote(place)


def tell_source(source: str) -> str:
    """Gives who said it."""
    return "a source left out, for it gives orders" if gives_orders(source) else quote(source)
