"""Episodes: every observation with its time, pose, picture and words, asked in many ways.

They lie beside the semantic map file, which stays the truth about places; episodes are the truth
about what was observed, when and from where.
"""

from mapspeak.semantic.episodes.asking import (
    EpisodeMatch,
    EpisodeOrder,
    EpisodePage,
    EpisodeQuery,
    Rank,
)
from mapspeak.semantic.episodes.observation import Observation, ObservationKind
from mapspeak.semantic.episodes.recording import named_pictures, observations_from
from mapspeak.semantic.episodes.store import EpisodeStore, memory_folder
from mapspeak.semantic.episodes.thinning import StoredPicture, ThinningRule, choose_dropped
from mapspeak.semantic.episodes.uniting import BroughtOver, bring_over
from mapspeak.semantic.episodes.vectors import VectorRank

__all__ = [
    "BroughtOver",
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
    "observations_from",
]
