"""A person's commands from the page, under the same guard and audit as every tool."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from mapspeak.errors import ConfigError, GoalError, LinkError, MapspeakError, SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory.events import Effect
from mapspeak.memory.store.forgetting import rename_place
from mapspeak.places.goalcheck import say_check
from mapspeak.places.naming import Place, Spot, is_taken_name, say_spot
from mapspeak.places.relations.choosing import check_place
from mapspeak.safety import Caller, Guard, calling
from mapspeak.server.text.offered import offering
from mapspeak.server.text.world.drives import not_stopped
from mapspeak.server.tools.memory import MemoryTools
from mapspeak.server.tools.paper import PaperTools
from mapspeak.server.view.feed import ViewFeed

AT_PAGE = "at the live page"
Metres = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Words = Annotated[str, Field(min_length=1, max_length=120)]


class CommandBody(BaseModel):
    """The arguments of a command."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Nothing(CommandBody):
    """Nothing."""


class MapTarget(CommandBody):
    """A point of the map, in metres."""

    x: Metres
    y: Metres


class PlaceNote(MapTarget):
    """A name for a point of the map."""

    name: Words


class WaitingId(CommandBody):
    """A command that waits, by its id."""

    id: str = Field(max_length=40)


class Answering(CommandBody):
    """A mission's question, by its id, and its answer."""

    question: str = Field(max_length=40)
    answer: str = Field(min_length=1, max_length=300)


class Closing(CommandBody):
    """The id of a closed area, and the end of its closure; empty for an open end."""

    place: Words
    until: str = Field("", max_length=40)


class EventId(CommandBody):
    """An event, by its id."""

    event: Words


class Renaming(CommandBody):
    """A remembered place, by its id, and its new name."""

    place: Words
    name: Words


class Forgetting(CommandBody):
    """A remembered place or thing, by its id."""

    what: Words


class PersonCommands:
    """Carries out a person's commands for one robot; each returns its result.

    Args:
        feed: Of the robot.
        person: Who commands.
    """

    def __init__(self, feed: ViewFeed, person: str) -> None:
        self._feed = feed
        self._session = feed.session
        self._client = f"{person} {AT_PAGE}"
        self._caller = Caller(client=self._client, tool="live page", session=self._client)

    async def carry_out(self, name: str, body: Mapping[str, Any]) -> str:
        """Carry out a command by its name.

        Raises:
            ValidationError: The body is not the command's.
            MapspeakError: It cannot be carried out.
        """
        model, act = self.by_name[name]
        wanted = model.model_validate(body)
        with calling(self._caller), offering(()):
            return await act(wanted)

    @property
    def by_name(
        self,
    ) -> Mapping[str, tuple[type[CommandBody], Callable[[Any], Awaitable[str]]]]:
        """Every command by its name: its arguments, and its function."""
        return {
            "stop": (Nothing, self._stop),
            "hold": (Nothing, self._hold),
            "release": (Nothing, self._release),
            "approve": (WaitingId, self._approve),
            "refuse": (WaitingId, self._refuse),
            "answer": (Answering, self._answer),
            "check": (MapTarget, self._check),
            "drive": (MapTarget, self._drive),
            "note": (PlaceNote, self._note_place),
            "close": (Closing, self._close),
            "end": (EventId, self._end),
            "rename": (Renaming, self._rename),
            "forget": (Forgetting, self._forget),
        }

    # --- the robot -------------------------------------------------------------------------------

    async def _stop(self, _: Nothing) -> str:
        try:
            await self._session.drives.stop()
        except LinkError as error:
            raise not_stopped(error) from error
        return "The robot was told to stop."

    async def _hold(self, nothing: Nothing) -> str:
        guard = self._require_guard()
        try:
            guard.hold.put(f"by {self._client}", at=guard.wall_clock())
        except ConfigError as error:
            stopped = await self._stop(nothing)
            raise ConfigError(
                f"{stopped} It is NOT HELD: {error.message}", hint=error.hint
            ) from error
        await self._stop(nothing)
        return "The robot was told to stop, and is held."

    async def _release(self, _: Nothing) -> str:
        was_held = self._require_guard().hold.lift()
        if was_held:
            self._note("release", "released")
        return "Released." if was_held else "Nothing was held."

    async def _approve(self, waiting: WaitingId) -> str:
        what = self._require_guard().approvals.fresh_room().approve(waiting.id)
        self._note("approval", f"approved {waiting.id}: {what}")
        return f"Approved: {what}."

    async def _refuse(self, waiting: WaitingId) -> str:
        what = self._require_guard().approvals.fresh_room().refuse(waiting.id)
        self._note("approval", f"refused {waiting.id}: {what}")
        return f"Refused: {what}."

    async def _answer(self, answering: Answering) -> str:
        book = self._feed.book
        if book is None:
            raise GoalError("This robot runs no missions.", hint="Nothing was answered.")
        question = book.runs.questions.find(answering.question, client=None)
        taken = book.runs.questions.answer(question, answering.answer)
        said = f"{question.id} is answered: {taken}."
        if self._session.guard is not None:
            self._note("answer", said)
        return said

    async def _check(self, target: MapTarget) -> str:
        world = await self._session.fetch_world_model()
        place = _place_at(target)
        goal = await self._session.compute(lambda: check_place(world, place))
        near = goal.check.nearest
        instead = "" if near is None else f" The nearest that works is {say_spot(near.point)}."
        return f"{say_check(goal.check)}{instead}"

    async def _drive(self, target: MapTarget) -> str:
        session = self._session
        self._feed.people.add(self._client)
        with session.client_is_heard(), session.drives.preparing() as ticket:
            goal = await session.find_goal(place=None, x=target.x, y=target.y, yaw_deg=None)
            drive = await session.drives.start(goal.pose, place=goal.name, ticket=ticket)
        return f"{drive.goal_id} to {drive.place} has begun."

    # --- the memory ------------------------------------------------------------------------------

    async def _note_place(self, note: PlaceNote) -> str:
        self._require_writable()
        await PaperTools(self._session).write_semantic_data(
            note.name, f"Noted by {self._client}.", x=note.x, y=note.y
        )
        return self._told(f"{note.name!r} is remembered at {say_spot(Point(note.x, note.y))}.")

    async def _close(self, closing: Closing) -> str:
        self._require_writable()
        said = await MemoryTools(self._session).note_event(
            f"{closing.place} is closed",
            place=closing.place,
            effect=Effect.CLOSED,
            ends=closing.until.strip() or None,
            source=self._client,
        )
        return self._told(said)

    async def _end(self, ending: EventId) -> str:
        self._require_writable()
        return self._told(await MemoryTools(self._session).end_event(ending.event))

    async def _rename(self, renaming: Renaming) -> str:
        self._require_writable()
        name, session = renaming.name.strip(), self._session
        if not name or is_taken_name(name):
            raise SemanticMapError(
                f"{name!r} is no name, or reads like an id.", hint="Give one in words."
            )
        world = await session.fetch_world_model(needs_memory=True)
        wanted = renaming.place.strip().upper()
        place = next((each for each in world.places if each.id == wanted), None)
        if place is None:
            raise SemanticMapError(f"There is no place {wanted!r} now.", hint="Click it again.")
        former = place.waypoint.name
        await session.compute(lambda: rename_place(session.memory, former, to=name))
        await session.fetch_world_model()
        return self._told(f"{former!r} is called {name!r} now.")

    async def _forget(self, forgetting: Forgetting) -> str:
        self._require_writable()
        said = await MemoryTools(self._session).forget(forgetting.what)
        await self._session.fetch_world_model()
        return self._told(said)

    def _told(self, said: str) -> str:
        """Note a change of the memory in the audit log, and return its text."""
        if self._session.guard is not None:
            self._note("memory", said)
        return said

    def _note(self, event: str, said: str) -> None:
        self._require_guard().note_event(event, said, robot_s=self._session.robot.now_s)

    def _require_guard(self) -> Guard:
        guard = self._session.guard
        if guard is None:
            raise GoalError("This robot has no guard.", hint="Stop it by its own button.")
        return guard

    def _require_writable(self) -> None:
        guard = self._session.guard
        if guard is not None and guard.policy.is_read_only:
            raise MapspeakError("The policy lets nothing be changed.", hint="Nothing was changed.")


def _place_at(target: MapTarget) -> Place:
    point = Point(target.x, target.y)
    return Place(say_spot(point), Spot(point))
