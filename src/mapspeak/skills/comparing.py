"""Values of results compared with required ones."""

from collections.abc import Mapping
from dataclasses import dataclass

from mapspeak.skill import JsonValue


def plain(value: JsonValue) -> str:
    """Return a value as people write it: 3 for 3.0, true for True."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.15g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True, slots=True)
class Comparison:
    """A condition on one field of a result.

    Attributes:
        equals: Its value, in any notation; None where any will do.
        above: It is a number above this.
        below: It is a number below this.
    """

    field: str
    equals: JsonValue = None
    above: float | None = None
    below: float | None = None

    def holds_in(self, result: Mapping[str, JsonValue]) -> bool:
        """Return True where the result has the field, and it is as wanted."""
        return self.field in result and self.holds_of(result[self.field])

    def holds_of(self, value: JsonValue) -> bool:
        """Return True where a value is as wanted."""
        if self.equals is not None and plain(value).casefold() != plain(self.equals).casefold():
            return False
        if self.above is None and self.below is None:
            return True
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        is_above = self.above is None or value > self.above
        return is_above and (self.below is None or value < self.below)
