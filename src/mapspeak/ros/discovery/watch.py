"""Looking for what a robot offers as long as it is connected: its parts are found bit by bit."""

from collections.abc import Callable
from contextlib import suppress

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection
from mapspeak.ros.discovery.finding import look_at_robot
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.discovery.parts import RobotPart, find_missing, improve
from mapspeak.ros.discovery.profile import RobotProfile
from mapspeak.ros.transforms import FrameListener

FRAMES_S = 2.0
PAUSE_S, LATER_PAUSE_S, LONGEST_PAUSE_S = 0.3, 5.0, 30.0
"""Between two looks: at first, and when all that is there counts as found, ever longer."""
LONGEST_SETTLING_S = 20.0
"""Some robots' topics come and go all the time."""


class RobotWatch:
    """Looks at a robot until it is known whole, and then on for what is missing.

    Nodes of ROS 2 are found one by one: some have been seen after 4.6 s, and Fast DDS repeats what
    was lost on the way after 3 s.

    Args:
        settling_s: Without anything new, in wall time, after which all that is there is found.

    Attributes:
        on_change: Is called with the profile of before when a better one is found.
        is_driving: Tells whether a drive of ours runs, so that the navigation must stay.
    """

    def __init__(
        self,
        connection: RosConnection,
        frames: FrameListener,
        overrides: RobotOverrides,
        *,
        settling_s: float,
    ) -> None:
        self._connection = connection
        self._frames = frames
        self._overrides = overrides
        self._settling_s = settling_s
        self._profile: RobotProfile | None = None
        self._begun_s = self._news_s = anyio.current_time()
        self._names: frozenset[str] = frozenset()
        self._frames_seen: frozenset[str] = frozenset()
        self._is_settled = False
        self.on_change: Callable[[RobotProfile], None] = lambda _: None
        self.is_driving: Callable[[], bool] = lambda: False

    @property
    def profile(self) -> RobotProfile:
        """What was found so far.

        Raises:
            LinkError: There has been no look yet.
        """
        if self._profile is None:
            raise LinkError("The robot has not been looked at yet.", hint="Try again in a moment.")
        return self._profile

    @property
    def missing(self) -> tuple[RobotPart, ...]:
        """The parts of which better may be found; what robot.yaml says is good enough."""
        return tuple(part for part in find_missing(self.profile) if not self._is_said(part))

    @property
    def is_complete(self) -> bool:
        """True when nothing better is to be found."""
        return not self.missing and self._leads_to_base

    @property
    def is_settled(self) -> bool:
        """True when all that is there counts as found."""
        now_s = anyio.current_time()
        self._is_settled = (
            self._is_settled
            or now_s - self._news_s >= self._settling_s
            or now_s - self._begun_s >= LONGEST_SETTLING_S
            or self.is_complete
        )
        return self._is_settled

    async def begin(self, *, frames_s: float) -> None:
        """Look for the first time, and wait a moment for frames from the map to the base.

        Raises:
            LinkError: The robot does not say what it offers.
        """
        while self._profile is None:
            try:
                await self.look()
            except LinkError:
                # Right after connecting, whoever would tell may not be found itself.
                if anyio.current_time() - self._begun_s >= self._settling_s:
                    raise
                await anyio.sleep(PAUSE_S)
        with anyio.move_on_after(frames_s):
            while not self._leads_to_base:
                await self._wait_for_frames()
                await self.look()

    async def run(self) -> None:
        """Look again and again while something is missing; for the background."""
        pause_s = PAUSE_S
        while not self.is_complete:
            await anyio.sleep(PAUSE_S)
            with anyio.move_on_after(pause_s - PAUSE_S):
                await self._wait_for_frames()
            before = self._profile
            with suppress(LinkError):
                await self.look()
            if self.is_settled:
                longer_s = max(2 * pause_s, LATER_PAUSE_S)
                pause_s = LATER_PAUSE_S if before != self._profile else longer_s
                pause_s = min(pause_s, LONGEST_PAUSE_S)

    async def find(self, part: RobotPart) -> None:
        """Return when a part is found; look once more for one that counts as missing.

        Raises:
            LinkError: The robot does not say what it offers.
        """
        await self.wait_for(part)
        if part in self.missing:
            await self.look()

    async def wait_for(self, part: RobotPart) -> None:
        """Return when a part is found, or counts as missing."""
        await self._wait_until(lambda: part not in self.missing)

    async def settle(self) -> None:
        """Return when all that is there counts as found."""
        await self._wait_until(lambda: False)

    async def look(self) -> None:
        """Take in what there is now: people start rosbridge first and SLAM later.

        Raises:
            LinkError: The robot does not say what it offers.
        """
        frames = self._frames.tree.frames
        now, names = await look_at_robot(self._connection, frames, self._overrides)
        if names != self._names or frames != self._frames_seen:
            self._news_s = anyio.current_time()
        self._names, self._frames_seen = names, frames
        before = self._profile
        self._profile = now
        if before is not None:
            self._profile = improve(
                before,
                now,
                is_settled=self._is_settled,
                keeps_navigation=self.is_driving(),
            )
        self._frames.listen(*self._profile.tf_topics, dialect=self._profile.dialect)
        if before is not None and before != self._profile:
            self._news_s = anyio.current_time()
            self.on_change(before)

    async def _wait_until(self, is_found: Callable[[], bool]) -> None:
        while not is_found() and not self.is_settled:
            with suppress(LinkError):
                await self.look()
            if not is_found() and not self.is_settled:
                await anyio.sleep(PAUSE_S)

    def _is_said(self, part: RobotPart) -> bool:
        is_dead = part.topic(self.profile) in self.profile.dead_topics
        return getattr(self._overrides, part.key) is not None and not is_dead

    @property
    def _leads_to_base(self) -> bool:
        if self._overrides.pose_topic not in (None, "tf"):
            return True
        profile = self.profile
        return self._frames.has_way(outer=profile.map_frame, inner=profile.base_frame)

    async def _wait_for_frames(self) -> None:
        """Return when a frame is there that has not been, or when they lead to the base at last."""
        did_lead = self._leads_to_base
        while self._frames.tree.frames == self._frames_seen and self._leads_to_base == did_lead:
            await self._frames.wait_for_news()
