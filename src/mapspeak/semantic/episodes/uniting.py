"""The observations of several memories of one map, brought over to another with their pictures."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from mapspeak.errors import SemanticMapError
from mapspeak.installation import shell_command
from mapspeak.semantic.episodes.moving import has_plans
from mapspeak.semantic.episodes.store import EpisodeStore, memory_folder

__all__ = ["BroughtOver", "bring_over"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BroughtOver:
    """What came over.

    Attributes:
        n_observations: Each once, in however many memories it was.
        n_pictures: Files.
    """

    n_observations: int = 0
    n_pictures: int = 0


def bring_over(*memories: Path, to: Path) -> BroughtOver:
    """Copies the observations of some semantic map files, with their pictures, for another one.

    All of them or none; those of the memories stay as they are.

    Args:
        memories: Semantic map files of one map.
        to: The file that they are for; it has no observations yet.

    Raises:
        SemanticMapError: It has some, or they cannot be read or written.
    """
    sources = [EpisodeStore(memory_folder(path)) for path in memories]
    for source in sources:
        _require_settled(source)
    folder = memory_folder(to)
    if folder.exists():
        message = f"{folder} is there already."
        raise SemanticMapError(message, hint="Give the new file another name, or remove it.")
    target = EpisodeStore(folder)
    try:
        came = [target.take_over(source) for source in sources]
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return BroughtOver(n_observations=sum(n for n, _ in came), n_pictures=sum(n for _, n in came))


def _require_settled(store: EpisodeStore) -> None:
    """Refuses observations that have not followed their records to a moved map yet."""
    if store.database.exists() and has_plans(store.database):
        raise SemanticMapError(
            f"The observations in {store.folder} have not followed their map yet.",
            hint=f"Start `{shell_command('serve --memory FILE')}` with it once, then merge again.",
        )
