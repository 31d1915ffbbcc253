"""The present facts of a session, for the conditions of skills and missions."""

from datetime import datetime

from mapspeak.errors import GoalError, LinkError, MapError
from mapspeak.geometry import Point
from mapspeak.places.naming import find_named
from mapspeak.places.relations.choosing import find_place
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.session import Session

BATTERY = "sensor_msgs/BatteryState"
HEAR_S = 3.0
KEPT_S = 2.0


class SessionFacts:
    """Facts of one session.

    Args:
        session: The session to ask.
        ros: The ROS system that may publish a battery.
    """

    def __init__(self, session: Session, ros: RosAccess) -> None:
        self._session = session
        self._ros = ros
        self._battery: tuple[float | None, float] | None = None

    @property
    def now_s(self) -> float:
        """Robot time."""
        return self._session.robot.now_s

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""
        await self._session.robot.sleep(duration_s)

    def read_calendar(self) -> datetime | None:
        """Return the operator's time; None where that is not known."""
        return self._session.find_wall_time()

    async def fetch_battery(self) -> float | None:
        """Return how full the battery is: as the robot itself tells, else a topic of its ROS."""
        if self._session.skilled is not None:
            return await self._session.skilled.fetch_battery()
        if self._session.ros is None:
            return None
        # A simulation that is begun anew sets its clock back.
        if self._battery is None or not 0.0 <= self.now_s - self._battery[1] <= KEPT_S:
            self._battery = (await self._hear_battery(), self.now_s)
        return self._battery[0]

    async def _hear_battery(self) -> float | None:
        inquiry = self._ros.inquiry
        try:
            topics = (await inquiry.fetch_topics()).types
            topic = next((name for name, kind in topics.items() if kind == BATTERY), None)
            if topic is None:
                return None
            heard = await inquiry.hear(topic, BATTERY, wait_s=HEAR_S)
        except LinkError:
            return None
        share = heard.messages[0].get("percentage") if heard.messages else None
        is_told = isinstance(share, int | float) and 0.0 <= share <= 1.0
        return float(share) if is_told and share is not None else None

    async def is_standing(self) -> bool:
        """Return True while no drive is under way."""
        return not self._session.drives.is_busy

    async def is_in(self, room: str) -> bool | None:
        """Return True where the robot is in a room, by its id or its name."""
        here = await self._here()
        try:
            world = await self._session.fetch_world_model()
        except (LinkError, MapError):
            return None
        found = await self._session.compute(lambda: world.find_room_id(here))
        if found == room.strip().upper():
            return True
        place = find_named(world, room)
        if place is None:
            return None
        return found is not None and world.find_room_id(place.point) == found

    async def is_near(self, place: str, within_m: float) -> bool | None:
        """Return True where the robot is so near to a place, in a straight line."""
        try:
            world = await self._session.fetch_world_model()
            point = await self._session.compute(lambda: find_place(world, place).point)
        except (GoalError, LinkError, MapError):
            return None
        return (await self._here()).distance_to(point) <= within_m

    async def has_event(self, words: str) -> bool | None:
        """Return True while an event lasts in whose words these stand."""
        now, wanted = self.read_calendar(), words.casefold().split()
        if now is None:
            return None
        for event in self._session.recall_events():
            begins, until = event.find_time(now)
            lasts = (begins is None or begins <= now) and (until is None or now < until)
            said = f"{event.text} {event.place}".casefold()
            if lasts and all(word in said for word in wanted):
                return True
        return False

    async def sees(self, label: str) -> bool | None:
        """Return True where the robot's detector reports such a thing now."""
        if self._session.robot.description.detector is None:
            return None
        wanted = label.casefold()
        found = await self._session.robot.fetch_detections()
        return any(wanted in each.label.casefold() for each in found)

    async def _here(self) -> Point:
        return (await self._session.robot.fetch_pose()).pose.point
