"""The tools that measure publications: the rates of topics, and the tree of frames."""

from functools import partial
from typing import Annotated

import anyio
from pydantic import Field

from mapspeak.errors import LinkError
from mapspeak.ros.census import ask_each, fetch_publishers
from mapspeak.ros.definitions.types import measure_message
from mapspeak.ros.listening import hear_frames
from mapspeak.ros.messages.fields import Message
from mapspeak.server.text.ros.frames import say_frames, say_transform
from mapspeak.server.text.ros.listening import say_measured, say_senders, say_silent
from mapspeak.server.text.ros.outcomes import refuse_name
from mapspeak.server.text.values import cut
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import full_name
from mapspeak.server.tools.ros.publishing import TRANSFORMS
from mapspeak.server.tools.toolset import ToolEffect, tool

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

    def __init__(self, ros: RosAccess) -> None:
        self._session = ros.session
        self._inquiry = ros.inquiry

    @tool("Rates of ROS topics", ToolEffect.READS, leads="{ros_read} shows the messages.")
    async def ros_rates(self, topics: Topics, duration_s: Listen = 3.0) -> str:
        """Measure several ROS topics at once: rate, bandwidth, age of stamps, which are silent.

        Use it to find what has died, is slow or late.
        """
        measure = partial(self._measure, duration_s)
        said = await ask_each(map(full_name, topics), measure, at_once=MOST_TOPICS)
        lines = [f"{name}: {each}" for name, each in said.items()]
        return cut("\n".join([f"listened for {duration_s:g} s", *lines]))

    async def _measure(self, duration_s: float, name: str) -> str:
        type_name = await self._inquiry.fetch_topic_type(name)
        heard = await self._inquiry.hear(name, type_name, wait_s=duration_s, duration_s=duration_s)
        if heard.n_received:
            n_bytes = await self._measure_size(type_name, heard.messages[-1])
            return say_measured(heard, now_s=self._session.robot.now_s, n_bytes=n_bytes)
        publishers = await fetch_publishers(self._inquiry.connection, name)
        return say_silent(heard, publishers)

    async def _measure_size(self, type_name: str, message: Message) -> int | None:
        try:
            described = await self._inquiry.describe(type_name, kind="msg")
        except LinkError:
            return None
        return measure_message(described.book, described.type, message)

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
        With frame: the transform between two frames, and its age.
        """
        graph, moving = await self._inquiry.fetch_topics(), full_name(topic)
        there = [name for name in (moving, f"{moving}_static") if name in graph.types]
        if not there:
            raise refuse_name("topic", moving, graph.topics_of(TRANSFORMS))
        connection = self._inquiry.connection
        type_name = graph.dialect.type_name(TRANSFORMS)
        heard = await hear_frames(connection, there, type_name=type_name, duration_s=duration_s)
        now_s, heard_s = self._session.robot.now_s, anyio.current_time()
        if frame is not None:
            outer, inner = in_frame.strip("/"), frame.strip("/")
            return say_transform(heard, outer=outer, inner=inner, now_s=now_s, heard_s=heard_s)
        tree = say_frames(list(heard.links.values()), now_s=now_s, heard_s=heard_s)
        senders = [say_senders(each, await fetch_publishers(connection, each)) for each in there]
        return cut("\n".join([f"listened for {duration_s:g} s", *senders, tree]))
