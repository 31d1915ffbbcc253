"""Every observation kept with its time, pose and picture; a failing disk costs nothing else."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Waypoint
from mapspeak.memory.episodes.observation import Observation, ObservationKind, observation_of
from mapspeak.memory.episodes.store import EpisodeStore


@dataclass(frozen=True, slots=True, kw_only=True)
class Keeping:
    """What became of an observation.

    Attributes:
        picture: The name under which its picture was kept; None where none was.
        fault: Why it was not kept, in words; empty if it was kept or did not have to be.
    """

    picture: str | None = None
    fault: str = ""


class EpisodeWriter:
    """Writes observations into a store of episodes.

    Args:
        store: Where they are kept.
        wall_clock: The operator's; without one nothing is kept, because records need a date.
    """

    def __init__(self, store: EpisodeStore, *, wall_clock: Callable[[], datetime] | None) -> None:
        self.store = store
        self._wall_clock = wall_clock

    @property
    def is_open(self) -> bool:
        """True when observations are written down."""
        return self._wall_clock is not None

    def close(self) -> None:
        """Keep nothing from now on: a client that only reads leaves no records."""
        self._wall_clock = None

    def keep(
        self,
        kind: ObservationKind,
        *,
        pose: Pose,
        text: str = "",
        picture: bytes | None = None,
        labels: tuple[str, ...] = (),
        stamp_s: float | None = None,
        room_id: str | None = None,
        name_map: Callable[[], str | None],
    ) -> Keeping:
        """Keep what is observed now.

        Args:
            kind: A picture, or words alone, such as that an event was noted or ended.
            pose: Where the robot stands, in the map frame.
            text: The words.
            picture: JPEG or PNG.
            labels: What the robot's own detector reports in it.
            stamp_s: Robot time of the exposure.
            room_id: Where that is.
            name_map: Tells which map the pose belongs to.
        """
        if self._wall_clock is None:
            return Keeping()
        observation = Observation(
            recorded_at=self._wall_clock(),
            pose=pose,
            kind=kind,
            text=text,
            labels=labels,
            stamp_s=stamp_s,
            room_id=room_id,
        )
        return self._write(observation, name_map, picture)

    def keep_record(self, waypoint: Waypoint, *, name_map: Callable[[], str | None]) -> Keeping:
        """Keep that a place was written down, with what was seen this time."""
        observation = observation_of(waypoint) if self.is_open else None
        return Keeping() if observation is None else self._write(observation, name_map)

    def _write(
        self,
        observation: Observation,
        name_map: Callable[[], str | None],
        picture: bytes | None = None,
    ) -> Keeping:
        try:
            of_map = replace(observation, map_id=name_map())
            kept = self.store.write(of_map, picture=picture)
        except SemanticMapError as error:
            return Keeping(fault=f"It was not kept as an episode: {error}")
        return Keeping(picture=kept.picture)
