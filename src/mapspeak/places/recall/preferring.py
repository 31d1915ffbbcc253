"""Which of several things of one name is known so much better that it is the answer."""

from collections.abc import Sequence

from mapspeak.places.recall.candidates import describe_candidate
from mapspeak.places.recall.wording import find_doubt
from mapspeak.worldmodel.model import Atlas, RememberedThing
from mapspeak.worldmodel.recollection import Remembered

__all__ = ["find_best_known"]

LEAST_VIEWS = 3
"""Two views of wrong things meet somewhere now and then; three hardly ever do."""
APART_M = 2.0
"""Of things of one name that stand nearer to each other, views may have been mixed up."""


def find_best_known(
    atlas: Atlas, meant: Sequence[Remembered], *, room_id: str | None
) -> RememberedThing | None:
    """Finds the one thing that views from three places agree on, with no other of its name near.

    Args:
        atlas: The map with the memory.
        meant: Of one name.
        room_id: Where it was asked for.

    Returns:
        None where there is none, or several, or where anything else speaks against it.
    """
    things = [each for each in meant if isinstance(each, RememberedThing)]
    if len(things) < len(meant):
        return None
    known = (each for each in things if each.thing.n_agreeing >= LEAST_VIEWS)
    sure = (
        each for each in known if not find_doubt(describe_candidate(atlas, each), room_id=room_id)
    )
    # To describe one costs much, and with a second one it is settled.
    best, second = next(sure, None), next(sure, None)
    if best is None or second is not None:
        return None
    near = [each for each in things if each.point.distance_to(best.point) < APART_M]
    return best if near == [best] else None
