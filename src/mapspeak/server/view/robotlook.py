"""The present state of the robot, as pages show it."""

import math

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.server.text.wording import say_pose_doubt
from mapspeak.server.text.world.drives import say_end
from mapspeak.server.view.document import DriveView, PoseView, RobotView, Spot
from mapspeak.session import Session


class RobotLook:
    """Looks at one robot; keeps the way of its latest drive.

    Attributes:
        camera_fov_rad: How wide its camera sees; None until a picture has told.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._path: tuple[str, list[Spot]] = ("", [])
        self.camera_fov_rad: float | None = None

    async def look(self) -> RobotView:
        """Return how the robot stands."""
        robot, guard = self._session.robot, self._session.guard
        pose, age_s, doubt, fault = None, 0.0, "", ""
        try:
            stamped = await robot.fetch_pose()
        except MapspeakError as error:
            fault = str(error)
        else:
            pose, age_s = PoseView.of(stamped.pose), round(robot.now_s - stamped.stamp_s, 1)
            doubt = say_pose_doubt(stamped.find_doubt(robot.now_s))
        return RobotView(
            pose=pose,
            age_s=age_s,
            doubt=doubt,
            fault=fault,
            held_by=None if guard is None else guard.hold.read(),
            drive=await self._describe_drive(),
            waiting={} if guard is None else guard.approvals.fresh_room().list_waiting(),
            cameras=self._name_cameras(),
            camera_fov_deg=self._find_fov_deg(),
        )

    def _name_cameras(self) -> tuple[str, ...]:
        try:
            return self._session.robot.description.cameras
        except LinkError:
            return ()

    def _find_fov_deg(self) -> float | None:
        """Return how wide the camera sees, as a page's or a tool's latest picture told."""
        ahead = (taken for taken in reversed(self._session.pictures.taken) if taken.is_ahead)
        latest = next(ahead, None)
        fov_rad = self.camera_fov_rad or (None if latest is None else latest.horizontal_fov_rad)
        return None if fov_rad is None else round(math.degrees(fov_rad), 1)

    async def _describe_drive(self) -> DriveView | None:
        drive, world = self._session.drives.latest, self._session.world
        if drive is None:
            return None
        status = drive.final or drive.heard
        path: list[Spot] = []
        if drive.final is None and world is not None:
            if self._path[0] != drive.goal_id:
                goal = drive.goal.point
                way = await self._session.compute(lambda: world.distances.way_to(goal))
                self._path = drive.goal_id, [(round(at.x, 2), round(at.y, 2)) for at in way or ()]
            path = self._path[1]
        return DriveView(
            id=drive.goal_id,
            place=drive.place,
            state=status.state.value,
            reason=say_end(status),
            goal=PoseView.of(drive.goal),
            path=path,
        )
