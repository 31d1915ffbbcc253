"""What there is to say about a kind of object."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.simulator.models.parts import Part


class Category(StrEnum):
    """How the paper's semantic filtering policy sorts a thing; what is often moved is "other"."""

    SAFETY = "safety"
    FUNCTIONAL = "functional"
    OTHER = "other"


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of object.

    Attributes:
        name: As world files write it.
        label: As people say it.
        category: Fixed safety equipment, fixed equipment with a use, or anything else.
        build: Makes its parts in the object's own frame, with z from its base.
        base_height_m: How high above the floor its base usually is.
        is_wall_hung: Its back is at x = 0 and belongs on a wall; else the origin is its middle.
    """

    name: str
    label: str
    category: Category
    build: Callable[[], tuple[Part, ...]]
    base_height_m: float = 0.0
    is_wall_hung: bool = False
