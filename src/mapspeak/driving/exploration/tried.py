"""What drives to frontiers have shown: where the robot has looked, and what it could not pass."""

from collections.abc import Iterable

from mapspeak.driving.drivereport import FAILED, FRONTIER, Drive
from mapspeak.driving.exploration.blocked import BlockedPlaces, TripEnd
from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState
from mapspeak.spatial.frontiers import ProvedGap, Tried, find_proved_gap
from mapspeak.worldmodel.revision import MapRevision

SAME_GAP_M = 0.5
MOST_GAPS = 30


class FrontierTries:
    """Learns from each drive once, on the map as it is after it."""

    def __init__(self) -> None:
        self._learned: set[str] = set()
        self._looked_from: list[Point] = []
        self._blocked = BlockedPlaces()
        self._gaps: list[ProvedGap] = []

    def learn(self, ended: Iterable[Drive], revision: MapRevision, robot: Pose) -> None:
        """Take in the drives that have ended.

        Args:
            robot: Where the robot is, for a drive of which it is not known where it gave up.
        """
        for drive in ended:
            if drive.goal_id in self._learned or drive.final is None:
                continue
            self._learned.add(drive.goal_id)
            if drive.final.state is GoalState.ARRIVED:
                self._blocked.forget(drive.goal.point)
                if FRONTIER.fullmatch(drive.place):
                    self._looked_from.append(drive.goal.point)
            elif drive.final.state in FAILED:
                self._learn_failure(drive, revision, drive.ended_at or robot.point)

    def find_tried(self, revision: MapRevision) -> Tried:
        """Return what counts on a map: what has changed there is worth another try."""
        places = [each.pose.point for each in self._blocked]
        grid = revision.grid
        return Tried(
            looked_from=tuple(self._looked_from),
            failed_at=tuple(at for at in places if self._blocked.is_closed(at, grid)),
            gaps=tuple(self._gaps),
        )

    def _learn_failure(self, drive: Drive, revision: MapRevision, stuck: Point) -> None:
        state = None if drive.final is None else drive.final.state
        end = TripEnd(goal_id=drive.goal_id, goal_state=state)
        self._blocked.remember(drive.place, drive.goal, stuck=stuck, end=end, grid=revision.grid)
        if state is not GoalState.BLOCKED:
            return
        gap = find_proved_gap(revision.distances_from(stuck), drive.goal.point)
        if gap is not None:
            others = [each for each in self._gaps if not _is_same(each, gap)]
            self._gaps = [*others, gap][-MOST_GAPS:]


def _is_same(one: ProvedGap, other: ProvedGap) -> bool:
    return one.point.distance_to(other.point) <= SAME_GAP_M
