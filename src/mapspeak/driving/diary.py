"""Every observation kept with its time, pose and picture; a failing disk costs nothing else."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Waypoint
from mapspeak.memory.episodes import (
    EpisodeStore,
    Observation,
    ObservationKind,
    observations_from,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Keeping:
    """What became of an observation.

    Attributes:
        picture: The name under which its picture was kept; None where none was.
        fault: Why it was not kept, in words; empty where it was, or nobody wanted it kept.
    """

    picture: str | None = None
    fault: str = ""


class Diary:
    """Writes observations into a store of episodes.

    Args:
        store: Where they are kept.
        wall_clock: The operator's; without one nothing is kept, since nobody could say when.

    Attributes:
        store: Where they are kept.
    """

    def __init__(self, store: EpisodeStore, *, wall_clock: Callable[[], datetime] | None) -> None:
        self.store = store
        self._wall_clock = wall_clock
        self._is_open = True

    @property
    def is_kept(self) -> bool:
        """True when observations are written down."""
        return self._is_open and self._wall_clock is not None

    def close(self) -> None:
        """Keep nothing from now on: whoever only reads leaves no traces."""
        self._is_open = False

    def keep_picture(
        self,
        content: bytes,
        *,
        pose: Pose,
        stamp_s: float,
        labels: tuple[str, ...] = (),
        room_id: str | None = None,
        map_id: str | None = None,
    ) -> Keeping:
        """Keep a picture that was just taken.

        Args:
            content: JPEG or PNG.
            pose: Where the robot stood, in the map frame.
            stamp_s: Robot time of the exposure.
            labels: What the robot's own detector reports in it.
            room_id: Where that is.
            map_id: Which map the pose belongs to.
        """
        return self._note(
            lambda now: Observation(
                recorded_at=now,
                pose=pose,
                kind=ObservationKind.PICTURE,
                labels=labels,
                stamp_s=stamp_s,
                map_id=map_id,
                room_id=room_id,
            ),
            content,
        )

    def keep_record(self, waypoint: Waypoint) -> Keeping:
        """Keep that a place was written down, with what was seen this time."""
        if not self.is_kept:
            return Keeping()
        keeping = Keeping()
        for observation in observations_from(waypoint):
            keeping = self._write(observation, None)
        return keeping

    def keep_note(
        self, text: str, *, pose: Pose, room_id: str | None = None, map_id: str | None = None
    ) -> Keeping:
        """Keep words alone, such as that an event was noted or ended.

        Args:
            text: The words.
            pose: Where the robot stood, in the map frame.
            room_id: Where that is.
            map_id: Which map the pose belongs to.
        """
        return self._note(
            lambda now: Observation(
                recorded_at=now,
                pose=pose,
                kind=ObservationKind.NOTE,
                text=text,
                room_id=room_id,
                map_id=map_id,
            )
        )

    def _note(
        self, observe: Callable[[datetime], Observation], picture: bytes | None = None
    ) -> Keeping:
        """Keep what is observed now; nothing where nothing is kept."""
        if not self._is_open or self._wall_clock is None:
            return Keeping()
        return self._write(observe(self._wall_clock()), picture)

    def _write(self, observation: Observation, picture: bytes | None) -> Keeping:
        try:
            kept = self.store.write(observation, picture=picture)
        except SemanticMapError as error:
            return Keeping(fault=f"It was not kept as an episode: {error}")
        return Keeping(picture=kept.picture)
