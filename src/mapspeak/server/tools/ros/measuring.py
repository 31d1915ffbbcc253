"""The tools that measure publications: the rates of topics, and the tree of frames."""

from typing import Annotated

import anyio
from pydantic import Field

from mapspeak.errors import LinkError
from mapspeak.server.tools.ros.census import fetch_publishers
from mapspeak.server.tools.ros.frames import TRANSFORMS, hear_frames, say_frames, say_transform
from mapspeak.server.tools.ros.inquiry import RosInquiry, full_name
from mapspeak.server.tools.ros.reading import Heard, hear, say_rate, say_stamp
from mapspeak.server.tools.ros.reports import cut
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

MOST_TOPICS = 20

Topics = Annotated[
    list[Annotated[str, Field(max_length=200)]],
    Field(description="full names", min_length=1, max_length=MOST_TOPICS),
]
Listen = Annotated[float, Field(description="seconds to listen", ge=0.2, le=25)]
PlacedFrame = Annotated[
    str | None, Field(description="tell only where this frame lies", max_length=200)
]
InFrame = Annotated[str, Field(description="seen from this one", max_length=200)]
FramesTopic = Annotated[
    str, Field(description="another robot's, such as /robot1/tf", max_length=200)
]


class MeasuringTools:
    """Listening for a time, and counting."""

    def __init__(self, session: Session, inquiry: RosInquiry) -> None:
        self._session = session
        self._inquiry = inquiry

    @tool("Rates of ROS topics", ToolEffect.READS, leads="{ros_read} shows the messages.")
    async def ros_rates(self, topics: Topics, duration_s: Listen = 3.0) -> str:
        """Measure several ROS topics at once: rate, age of the stamps, which are silent.

        Use it to find what has died, is slow or late.
        """
        said: dict[str, str] = {}

        async def measure(name: str) -> None:
            try:
                said[name] = await self._measure(name, duration_s)
            except LinkError as error:
                said[name] = f"{name}: {error}"

        names = list(dict.fromkeys(full_name(topic) for topic in topics))
        async with anyio.create_task_group() as tasks:
            for name in names:
                tasks.start_soon(measure, name)
        return cut("\n".join([f"listened for {duration_s:g} s", *(said[name] for name in names)]))

    @tool("The tree of TF frames", ToolEffect.READS)
    async def ros_frames(
        self,
        topic: FramesTopic = "/tf",
        duration_s: Listen = 3.0,
        frame: PlacedFrame = None,
        in_frame: InFrame = "map",
    ) -> str:
        """Tell the tree of TF frames: each transform's rate and age, static or not, who sends it.

        Use it when a transform is missing or late; it names loops, two parents and gaps.
        With frame: the transform between two frames.
        """
        moving = full_name(topic)
        graph = await self._inquiry.fetch_topics()
        static = f"{moving}_static"
        if moving not in graph.types and static not in graph.types:
            raise self._inquiry.stranger("topic", moving, graph.topics_of(TRANSFORMS))
        type_name = graph.dialect.type_name(TRANSFORMS)
        there = [(name, name == static) for name in (moving, static) if name in graph.types]
        heard = await hear_frames(
            self._inquiry.connection,
            [(name, type_name, is_static) for name, is_static in there],
            duration_s=duration_s,
        )
        if frame is not None:
            return say_transform(heard.tree, outer=in_frame.strip("/"), inner=frame.strip("/"))
        senders = [f"{name} published by: {await self._say_senders(name)}" for name, _ in there]
        now_s, heard_s = self._session.robot.now_s, anyio.current_time()
        tree = say_frames(list(heard.links.values()), now_s=now_s, heard_s=heard_s)
        return cut("\n".join([f"listened for {duration_s:g} s", *senders, tree]))

    async def _say_senders(self, topic: str) -> str:
        publishers = await fetch_publishers(self._inquiry.connection, topic)
        if len(publishers.others) < 2:
            return publishers.say()
        return f"{publishers.say()} (which of them sends which is not told)"

    async def _measure(self, name: str, duration_s: float) -> str:
        type_name = await self._inquiry.fetch_topic_type(name)
        heard = await hear(
            self._inquiry.connection,
            name,
            type_name=await self._inquiry.said(type_name),
            n=1,
            wait_s=duration_s,
            duration_s=duration_s,
        )
        if not heard.n_received:
            publishers = await fetch_publishers(self._inquiry.connection, name)
            return f"{name}: SILENT, {say_silence(heard)}; published by {publishers.say()}"
        stamp = say_stamp(
            heard.messages[-1],
            now_s=self._session.robot.now_s,
            age_s=heard.age_s,
            period_s=heard.period_s,
        )
        many = "1 message" if heard.n_received == 1 else f"{heard.n_received} messages"
        rate = f"{say_rate(heard.rate_hz)}, {many}" if heard.n_received > 1 else many
        stopped = f"; STOPPED, the last {heard.age_s:.1f} s ago" if heard.has_stopped else ""
        return f"{name}: {rate}{stopped}{f'; {stamp}' if stamp else ''}"


def say_silence(heard: Heard) -> str:
    """Say for how long nothing has come."""
    if heard.age_s < heard.known_for_s:
        return f"the last message came {heard.age_s:.1f} s ago"
    return f"nothing came in the {heard.known_for_s:.1f} s since we listen"
