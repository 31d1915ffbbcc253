"""All kinds of objects, by name."""

from functools import cache, lru_cache
from types import MappingProxyType

from mapspeak.errors import ConfigError
from mapspeak.geometry import Point
from mapspeak.simulator.models.appliances import APPLIANCES
from mapspeak.simulator.models.footprints import find_outlines
from mapspeak.simulator.models.forklift import FORKLIFT
from mapspeak.simulator.models.furniture import FURNITURE
from mapspeak.simulator.models.kinds import Kind
from mapspeak.simulator.models.parts import Part
from mapspeak.simulator.models.safety import SAFETY_EQUIPMENT
from mapspeak.simulator.models.warehouse import WAREHOUSE_EQUIPMENT

_CATALOGUE = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            *SAFETY_EQUIPMENT,
            *WAREHOUSE_EQUIPMENT,
            FORKLIFT,
            *FURNITURE,
            *APPLIANCES,
        )
    }
)

KINDS: tuple[str, ...] = tuple(_CATALOGUE)
"""The names of all kinds, as world files write them."""


def find_kind(name: str) -> Kind:
    """Gives what there is to say about a kind.

    Raises:
        ConfigError: There is no kind of that name.
    """
    try:
        return _CATALOGUE[name]
    except KeyError:
        raise ConfigError(
            f"There is no kind of object called {name!r}.",
            hint=f"Use one of: {', '.join(sorted(KINDS))}.",
        ) from None


@cache
def build_parts(kind: str) -> tuple[Part, ...]:
    """Gives the parts of a kind in its own frame, with z from its base."""
    return find_kind(kind).build()


@lru_cache(maxsize=1024)
def footprint(kind: str, low_m: float, high_m: float) -> tuple[tuple[Point, ...], ...]:
    """Gives the convex outlines of a kind's solid parts between two heights above the floor.

    They are counter-clockwise in the object's own frame (x to its front), for an object at its
    kind's usual base height. For one that hangs d metres higher, ask for the band d metres lower.

    Raises:
        ConfigError: There is no kind of that name.
    """
    base = find_kind(kind).base_height_m
    return find_outlines(build_parts(kind), low_m - base, high_m - base)
