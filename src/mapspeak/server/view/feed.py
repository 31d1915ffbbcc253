"""Live news for pages: one watch of a robot, shared by all pages."""

import json
import logging
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

import anyio
from anyio.streams.memory import MemoryObjectReceiveStream, MemoryObjectSendStream

from mapspeak.errors import MapspeakError
from mapspeak.robot import CameraPicture
from mapspeak.server.text.skills import draw_mission, say_question
from mapspeak.server.tools.skills.book import SkillBook
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.document import (
    CallView,
    GridView,
    MissionsView,
    PoseView,
    QuestionView,
    RobotLook,
    RobotView,
    draw_tile,
)
from mapspeak.server.view.overlay import Overlay
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel

POSE_S = 0.1
IDLE_S = 1.0
MAP_EVERY = 10
"""Every so many looks at the pose, look at the map and send pages a sign of life."""
PICTURE_S = 1.0
"""Pages that ask within that time of each other are given the same picture."""
MOST_UNREAD = 200
"""A page that reads no more than that is let go; it comes back when it can."""
TRAIL_M = 0.25
MOST_TRAIL = 4000

logger = logging.getLogger(__name__)


class ViewFeed:
    """Watches one robot for the pages that show it; hardly looks while none does.

    Attributes:
        robot: Looks at the robot itself.
        people: The names of those who have commanded from a page.
        book: Of the missions; None for a robot that runs none.
    """

    def __init__(self, session: Session, calls: CallFeed, book: SkillBook | None = None) -> None:
        self.session = session
        self.calls = calls
        self.robot = RobotLook(session)
        self.people: set[str] = set()
        self.book = book
        self._grids: tuple[tuple[OccupancyGrid, GridView], ...] = ()
        self._drawn: dict[str, bytes] = {}
        self._pages: set[MemoryObjectSendStream[bytes]] = set()
        self._has_page = anyio.Event()
        self._map: GridView | None = None
        self._world: WorldModel | None = None
        self._overlay = Overlay()
        self._trail: list[tuple[float, float]] = []
        self._robot: RobotView | None = None
        self._missions = MissionsView()
        self._has_failed = False
        self._looking = anyio.Lock()
        self._pictures: dict[str, tuple[CameraPicture, float]] = {}
        calls.tell = self._tell_call

    @asynccontextmanager
    async def listen(self) -> AsyncGenerator[MemoryObjectReceiveStream[bytes]]:
        """Receive all that happens from now on, first how everything stands."""
        send, receive = anyio.create_memory_object_stream[bytes](MOST_UNREAD)
        for event in self._first_events():
            send.send_nowait(event)
        self._pages.add(send)
        self._has_page.set()
        try:
            yield receive
        finally:
            self._pages.discard(send)
            send.close()
            receive.close()

    async def watch(self) -> None:
        """Look at the robot and tell the pages, until cancelled; without pages keep the trail."""
        n_looks = 0
        while True:
            await self._look(with_map=bool(self._pages) and n_looks % MAP_EVERY == 0)
            self._hear_person()
            n_looks = n_looks + 1 if self._pages else 0
            if self._pages:
                await anyio.sleep(POSE_S)
                continue
            with anyio.move_on_after(IDLE_S):
                await self._has_page.wait()
            self._has_page = anyio.Event()

    async def _look(self, *, with_map: bool) -> None:
        try:
            if with_map:
                self._tell(_event("alive", None))
                await self._look_at_map()
                self._look_at_missions()
            await self._look_at_robot()
        except Exception:  # an error of ours in a page must not end the server of a robot
            if not self._has_failed:
                logger.exception("The live page is not told all that happens.")
            self._has_failed = True

    def _hear_person(self) -> None:
        """Keep a drive alive that a person began here, while a page is open; no other drive."""
        drive = self.session.drives.under_way
        if self._pages and drive is not None and drive.caller.owner in self.people:
            with self.session.client_is_heard():
                pass

    def _first_events(self) -> list[bytes]:
        events = [_event("calls", [call.model_dump() for call in self.calls.calls])]
        if self._map is not None:
            events += [_event("map", self._map.model_dump())]
        events += [_event("overlay", self._overlay.model_dump()), _event("trail", self._trail)]
        if self._missions != MissionsView():
            events += [_event("missions", self._missions.model_dump())]
        if self._robot is not None:
            events += [_event("robot", self._robot.model_dump())]
        return events

    def _tell(self, event: bytes) -> None:
        for page in list(self._pages):
            try:
                page.send_nowait(event)
            except (anyio.WouldBlock, anyio.BrokenResourceError, anyio.ClosedResourceError):
                self._pages.discard(page)
                page.close()

    async def draw(self, row: int, col: int, name: str) -> bytes | None:
        """Return a tile of the latest map or the one before it, drawn once for all pages."""
        for grid, view in self._grids:
            if row < len(view.tiles) and col < len(view.tiles[0]) and view.tiles[row][col] == name:
                if name not in self._drawn:
                    self._drawn[name] = await self.session.compute(
                        partial(draw_tile, grid, row, col)
                    )
                return self._drawn[name]
        return None

    async def see(self, camera: str | None = None) -> CameraPicture:
        """Return what a camera sees; by its name, or ahead.

        Pages that ask at about the same time are given one picture.

        Raises:
            LinkError: It gives none.
        """
        async with self._looking:
            now_s, robot = anyio.current_time(), self.session.robot
            name = robot.description.find_camera(camera) if camera else ""
            if name not in self._pictures or now_s - self._pictures[name][1] > PICTURE_S:
                picture = await robot.fetch_picture(name or None)
                self._pictures[name] = picture, now_s
                if not name and picture.horizontal_fov_rad is not None:
                    self.robot.camera_fov_rad = picture.horizontal_fov_rad
            return self._pictures[name][0]

    def tell_word(self, said: str, *, page: str) -> None:
        """Tell all pages of a person's command at one of them."""
        self._tell(_event("word", {"said": said, "page": page}))

    def _tell_call(self, call: CallView) -> None:
        self._tell(_event("call", call.model_dump()))

    async def _look_at_map(self) -> None:
        """Tell changes of the map, and of things that the tools have found on it."""
        try:
            grid = await self.session.robot.fetch_map()
        except MapspeakError:
            return
        if (shown := await self.session.compute(partial(GridView.of, grid))) != self._map:
            self._map = shown
            self._grids = (*self._grids[-1:], (grid, shown))
            known = {name for _, view in self._grids for names in view.tiles for name in names}
            self._drawn = {name: png for name, png in self._drawn.items() if name in known}
            self._tell(_event("map", shown.model_dump()))
        world = self.session.world
        if world is not None:
            overlay = await self.session.compute(partial(Overlay.of, world))
            if overlay != self._overlay:
                self._overlay = overlay
                self._tell(_event("overlay", overlay.model_dump()))

    def _look_at_missions(self) -> None:
        shown = MissionsView() if self.book is None else _describe_missions(self.book)
        if shown != self._missions:
            self._missions = shown
            self._tell(_event("missions", shown.model_dump()))

    async def _look_at_robot(self) -> None:
        shown = await self.robot.look()
        if shown.pose is not None:
            self._note_trail(shown.pose)
        if shown != self._robot:
            self._robot = shown
            self._tell(_event("robot", shown.model_dump()))

    def _note_trail(self, pose: PoseView) -> None:
        at = (round(pose.x, 2), round(pose.y, 2))
        last = self._trail[-1] if self._trail else None
        if last is None or abs(at[0] - last[0]) + abs(at[1] - last[1]) >= TRAIL_M:
            self._trail.append(at)
            del self._trail[:-MOST_TRAIL]


def _describe_missions(book: SkillBook) -> MissionsView:
    latest = book.desk.latest
    return MissionsView(
        latest=None if latest is None else draw_mission(latest.mission),
        is_over=latest is None or latest.is_over,
        states={} if latest is None else {n: str(each) for n, each in latest.states.items()},
        questions=tuple(
            QuestionView(
                id=each.id,
                said=say_question(each),
                answers=tuple(each.given.get("answers", ())),
                picture="" if each.picture is None else f"questions/{each.id}",
            )
            for each in book.runs.questions.waiting.values()
        ),
        saved=tuple(draw_mission(each) for each in book.saved.values()),
    )


def _event(kind: str, data: Any) -> bytes:  # noqa: ANN401 - JSON of any shape
    """Return an event as a page reads it (WHATWG HTML, server-sent events)."""
    return f"event: {kind}\ndata: {json.dumps(data, separators=(',', ':'))}\n\n".encode()
