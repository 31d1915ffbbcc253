"""Requests such as "ladder in R3", put to what answers `find_place`."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from benchmarks.memory.sites import RADIUS_M, Site
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMap
from mapspeak.memory.search.meaningindex import Embedder
from mapspeak.places.asking import Recall, RecallQuery, recall
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector

__all__ = ["FindModel", "Request", "ask", "list_requests", "open_world"]

FindModel = Callable[[], Embedder | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What somebody wants to be driven to.

    Attributes:
        label: What it is called.
        room_id: In which room; None where any will do.
    """

    label: str
    room_id: str | None

    @property
    def words(self) -> str:
        """As a person says it."""
        return self.label if self.room_id is None else f"{self.label} in {self.room_id}"


def open_world(site: Site, places: SemanticMap, find_model: FindModel) -> WorldModel:
    """Return what the robot knows at its start: map and records, nothing that is true.

    Args:
        site: The building.
        places: What was written down.
        find_model: Gives what compares meanings, or None.
    """
    start = Pose(0.0, 0.0, 0.0)
    return WorldModel(
        site.grid,
        start,
        places,
        radius_m=RADIUS_M,
        revision=site.revision,
        recollector=Recollector(find_model),
    )


def list_requests(site: Site) -> Iterator[tuple[int, Request]]:
    """Ask for every thing of a building, by its name alone and by name and room.

    Each comes with the number of the thing that gave rise to it.
    """
    for number, truth in enumerate(site.things):
        yield number, Request(label=truth.label, room_id=None)
        room_id = site.room_of(truth)
        if room_id is not None:
            yield number, Request(label=truth.label, room_id=room_id)


def ask(world: WorldModel, request: Request) -> Recall:
    """Return the answer of the memory."""
    return recall(world, RecallQuery(words=request.words))
