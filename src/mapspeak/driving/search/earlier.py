"""What pictures from before a search say about the thing: looked at, reported, or not read at all.

A picture counts as looked at only where somebody read it with such things in mind: the robot's own
detector, which would have reported one, or a model that was asked for this very thing and saw none.
That one was taken, and perhaps shown for another reason, says nothing.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mapspeak.driving.search.words import speaks_of
from mapspeak.geometry import Pose
from mapspeak.semantic import SemanticMap, TakenPicture

__all__ = ["Earlier", "Look", "leave_out_shown", "read_earlier"]

MOST_REPORTS = 4
APART_M = 1.0
"""Reports from nearer to each other are one place to look again from."""

Look = tuple[Pose, float | None]
"""Where the camera was, in the map frame, and its opening."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Earlier:
    """What is known of a thing from pictures before a search.

    Attributes:
        looks: Those that count as looked at, and did not show it.
        reporting: Those in which the robot's detector reported it, the latest first.
        n_unread: How many say nothing, for nobody read them.
    """

    looks: tuple[Look, ...] = ()
    reporting: tuple[TakenPicture, ...] = ()
    n_unread: int = 0

    @property
    def sentence(self) -> str:
        """The same in words; empty where there were no pictures."""
        told = []
        if self.looks:
            told.append(f"{len(self.looks)} earlier pictures count as looked at, and had none")
        if self.reporting:
            ids = ", ".join(each.id for each in self.reporting)
            told.append(f"the detector reported it in {ids}")
        if self.n_unread:
            told.append(f"{self.n_unread} earlier pictures do not count: nobody looked for it then")
        said = "; ".join(told)
        return f"{said[:1].upper()}{said[1:]}." if said else ""


def read_earlier(
    pictures: Iterable[TakenPicture], thing: str, *, judged: Sequence[Look] = ()
) -> Earlier:
    """Gives what pictures from before a search say about a thing.

    Args:
        pictures: The oldest first.
        thing: What will be looked for.
        judged: Looks of an earlier search for the same thing, in which a model saw none.
    """
    taken = list(pictures)
    read = [each for each in taken if each.reported is not None]
    labels = {label for each in read for label in each.reported or ()}
    speaking = {label for label in labels if speaks_of(label, thing)}
    found = [each for each in read if speaking.intersection(each.reported or ())]
    none = [each for each in read if each not in found]
    looks = dict.fromkeys((each.pose, each.horizontal_fov_rad) for each in none)
    looks |= dict.fromkeys(judged)
    unread = (each for each in taken if each.reported is None)
    return Earlier(
        looks=tuple(looks),
        reporting=_apart(found[::-1]),
        n_unread=sum((each.pose, each.horizontal_fov_rad) not in looks for each in unread),
    )


def leave_out_shown(
    pictures: Iterable[TakenPicture], memory: SemanticMap, thing: str
) -> tuple[TakenPicture, ...]:
    """Gives pictures without those in which somebody saw the thing and wrote it down.

    The detector may have had no word for it; where it was seen, the memory says.
    """
    labels = {each.label for place in memory.waypoints for each in place.landmarks}
    speaking = {label for label in labels if speaks_of(label, thing)}
    shown = {
        place.dated(each).picture
        for place in memory.waypoints
        for each in place.landmarks
        if each.label in speaking
    }
    return tuple(each for each in pictures if each.name not in shown)


def _apart(pictures: Iterable[TakenPicture]) -> tuple[TakenPicture, ...]:
    chosen: list[TakenPicture] = []
    for picture in pictures:
        point = picture.pose.point
        if all(point.distance_to(each.pose.point) > APART_M for each in chosen):
            chosen.append(picture)
    return tuple(chosen[:MOST_REPORTS])
