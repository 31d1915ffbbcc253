"""What a person may do from the page, under the same guard and audit as every tool."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from mapspeak.errors import ConfigError, GoalError, LinkError
from mapspeak.geometry import Point
from mapspeak.places.goalcheck import say_check
from mapspeak.places.naming import Place, Spot, say_spot
from mapspeak.places.relations.choosing import check_place
from mapspeak.safety import Caller, Guard, calling
from mapspeak.server.text.drives import not_stopped
from mapspeak.session import Session

PERSON = "a person at the live page"
CALLER = Caller(client=PERSON, tool="live page")
Metres = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]


class MapTarget(BaseModel):
    """A point of the map, in metres."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    x: Metres
    y: Metres


class Wish(BaseModel):
    """A command that waits, by its id."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: str = Field(max_length=40)


class PersonCommands:
    """Carries out a person's commands for one robot; each says what came of it."""

    def __init__(self, session: Session) -> None:
        self._session = session

    async def stop(self) -> str:
        """Stop the robot at once and end every drive."""
        with calling(CALLER):
            try:
                await self._session.drives.stop()
            except LinkError as error:
                raise not_stopped(error) from error
        return "The robot was told to stop."

    async def hold(self) -> str:
        """Stop the robot, and let nobody drive it until it is released."""
        guard = self._require_guard()
        try:
            guard.hold.put(f"by {PERSON}", at=guard.wall_clock())
        except ConfigError as error:
            stopped = await self.stop()
            raise ConfigError(
                f"{stopped} It is NOT HELD: {error.message}", hint=error.hint
            ) from error
        await self.stop()
        return "The robot was told to stop, and is held."

    async def release(self) -> str:
        """Let a held robot drive again."""
        was_held = self._require_guard().hold.lift()
        if was_held:
            self._note("release", "released")
        return "Released." if was_held else "Nothing was held."

    async def approve(self, wish: Wish) -> str:
        """Agree to a command that waits, once."""
        what = self._require_guard().approvals.room.approve(wish.id)
        self._note("approval", f"approved {wish.id}: {what}")
        return f"Approved: {what}."

    async def refuse(self, wish: Wish) -> str:
        """Take a command that waits off the list."""
        what = self._require_guard().approvals.room.refuse(wish.id)
        self._note("approval", f"refused {wish.id}: {what}")
        return f"Refused: {what}."

    async def check(self, target: MapTarget) -> str:
        """Say whether the robot can drive to a point."""
        world = await self._session.fetch_world_model()
        place = _place_at(target)
        goal = await self._session.compute(lambda: check_place(world, place))
        near = goal.check.nearest
        instead = "" if near is None else f" The nearest that works is {say_spot(near.point)}."
        return f"{say_check(goal.check)}{instead}"

    async def drive(self, target: MapTarget) -> str:
        """Send the robot to a point."""
        session = self._session
        with calling(CALLER), session.client_is_heard(), session.drives.preparing() as ticket:
            goal = await session.find_goal(place=None, x=target.x, y=target.y, yaw_deg=None)
            drive = await session.drives.start(
                goal.pose, place=goal.title, ticket=ticket, client=PERSON
            )
        return f"{drive.goal_id} to {drive.place} has begun."

    def _note(self, event: str, said: str) -> None:
        with calling(CALLER):
            self._require_guard().note_event(event, said, robot_s=self._session.robot.now_s)

    def _require_guard(self) -> Guard:
        guard = self._session.guard
        if guard is None:
            raise GoalError("This robot has no guard.", hint="Stop it by its own button.")
        return guard


def _place_at(target: MapTarget) -> Place:
    point = Point(target.x, target.y)
    return Place(say_spot(point), Spot(point))
