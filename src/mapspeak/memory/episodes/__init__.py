"""Episodes: every observation with its time, pose, picture and words, asked in many ways.

They lie beside the semantic map file, which stays the truth about places; episodes are the truth
about what was observed, when and from where.
"""

from mapspeak.memory.episodes.observation import (
    EpisodeFilter,
    EpisodeMatch,
    EpisodeOrder,
    EpisodePage,
    EpisodeQuery,
    Observation,
    ObservationKind,
    Rank,
    named_pictures,
    observation_of,
)
from mapspeak.memory.episodes.pictures import StoredPicture, ThinningRule, choose_dropped
from mapspeak.memory.episodes.store import BroughtOver, EpisodeStore, bring_over, memory_folder
from mapspeak.memory.episodes.textindex import VectorRank

__all__ = [
    "BroughtOver",
    "EpisodeFilter",
    "EpisodeMatch",
    "EpisodeOrder",
    "EpisodePage",
    "EpisodeQuery",
    "EpisodeStore",
    "Observation",
    "ObservationKind",
    "Rank",
    "StoredPicture",
    "ThinningRule",
    "VectorRank",
    "bring_over",
    "choose_dropped",
    "memory_folder",
    "named_pictures",
    "observation_of",
]
