"""Message types as tools: how many of 200 round-trip, how long schemas are, how fast they list.

120 types are made up by a seeded generator, nested to five, the others are ROS's own. Each becomes
a topic of our own rosbridge server and a skill that publishes on it; the message that arrives is
compared with the one that the arguments were made of. CDR is what links over DDS and rclpy write.
"""

import json
import random
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import anyio
from mcp.client import Client

from benchmarks.figure import Figure
from benchmarks.typemaking import make_message, make_types
from mapspeak.errors import MapspeakError
from mapspeak.links.cdr import Codec
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.links.simulated import Clock, open_simulated_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.definitions.types import TypeBook
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server.hub import Hub, Publication, Topic
from mapspeak.rosbridge_server.interfaces import Interfaces, RosSystem
from mapspeak.rosbridge_server.rosapi import Parameters, add_rosapi
from mapspeak.rosbridge_server.serving import serve_system
from mapspeak.server.app import build_server
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.skills.interfaces import Interface, open_interface
from mapspeak.session import Session
from mapspeak.simulator import Simulation, load_world
from mapspeak.skill import (
    Arguments,
    OnProgress,
    Skill,
    SkillEffect,
    SkillOutcome,
    SkillSpec,
)
from mapspeak.skills.arguments import schema_of
from mapspeak.skills.layout import build_layout
from mapspeak.skills.skillsfile import Called

__all__ = ["measure"]

SEED = 7
N_AT_ONCE = 20
N_LISTED = 50
N_LISTINGS = 20
ARRIVES_S = 5.0


def measure() -> Iterator[Figure]:
    """Return how many types came through, the median schema, and the time of a list of tools."""
    for dialect in Dialect:
        book, names = make_types(SEED, dialect=dialect)
        n_same = anyio.run(_count_over_rosbridge, dialect, book, names)
        yield Figure(name=f"same over rosbridge, {dialect}", value=n_same, unit=f"of {len(names)}")
        sizes = [_schema_bytes(book, name) for name in names]
        yield Figure(name=f"schema, {dialect}", value=statistics.median(sizes), unit="bytes")
        yield Figure(name=f"longest schema, {dialect}", value=max(sizes), unit="bytes")
    book, names = make_types(SEED, dialect=Dialect.ROS2)
    yield Figure(name="same in CDR", value=_count_in_cdr(book, names), unit=f"of {len(names)}")
    yield Figure(name=f"list {N_LISTED} skills", value=anyio.run(_time_listing), unit="ms")


def _schema_bytes(book: TypeBook, name: str) -> int:
    schema = schema_of(build_layout(book, name).parameters)
    return len(json.dumps(schema, separators=(",", ":"), ensure_ascii=False).encode())


def _count_in_cdr(book: TypeBook, names: list[str]) -> int:
    dice, codec, n_same = random.Random(SEED), Codec(book), 0  # noqa: S311 - no secrets
    for name in names:
        layout, message = build_layout(book, name), make_message(book, name, dice)
        arguments = json.loads(json.dumps(layout.read(message)))
        back = codec.decode(name, codec.encode(name, layout.build(arguments)))
        n_same += layout.read(back) == arguments
    return n_same


async def _count_over_rosbridge(dialect: Dialect, book: TypeBook, names: list[str]) -> int:
    heard: dict[str, Any] = {}
    has_all = anyio.Event()

    def take(publication: Publication) -> None:
        # A velocity is followed by others, and by a stand.
        heard.setdefault(publication.topic, publication.message)
        if len(heard) == len(names):
            has_all.set()

    topics = {f"/made/t{at}": name for at, name in enumerate(names)}
    hub = Hub([Topic(name=each, type=kind, subscribers=("/n",)) for each, kind in topics.items()])
    for topic in topics:
        hub.take(topic, take)
    system = RosSystem(hub, Interfaces(dialect, more=book.texts), dialect=dialect)
    add_rosapi(system, Parameters(dialect, {}), lambda: 0.0)
    sent: dict[str, Any] = {}
    async with (
        serve_system(system) as server,
        open_client(RobotAddress(url=server.url)) as client,
    ):
        with tempfile.TemporaryDirectory() as folder:
            async with open_simulated_robot(
                Simulation(load_world("flat_1"), seed=0), clock=Clock.VIRTUAL, has_detector=False
            ) as robot:
                memory = SemanticMapStore(Path(folder) / "memory.yaml")
                ros = RosAccess(Session(robot, memory, lease_s=60.0, ros=client))
                await _publish_all(ros, topics, book, sent)
                with anyio.move_on_after(ARRIVES_S):
                    await has_all.wait()
    return sum(
        build_layout(book, kind).read(heard.get(topic, {})) == sent.get(topic)
        for topic, kind in topics.items()
    )


async def _publish_all(
    ros: RosAccess, topics: dict[str, str], book: TypeBook, sent: dict[str, Any]
) -> None:
    """Publish by a skill of each topic; what was given is noted, by topic."""
    dice, turns = random.Random(SEED), anyio.CapacityLimiter(N_AT_ONCE)  # noqa: S311 - no secrets

    async def publish(topic: str, kind: str, message: dict[str, Any]) -> None:
        async with turns:
            try:
                interface = Interface(Called.PUBLISH, topic, kind)
                skill = await open_interface(interface, ros, name="any")
                given = json.loads(json.dumps(build_layout(book, kind).read(message)))
                extra = {"for_s": 0.1} if interface.is_velocity else {}
                await skill.run(given | extra, lambda _: None)
            except MapspeakError as error:
                print(f"{topic} ({kind}): {error}")  # noqa: T201 - tells what did not come through
                return
            sent[topic] = given

    async with anyio.create_task_group() as tasks:
        for topic, kind in topics.items():
            tasks.start_soon(publish, topic, kind, make_message(book, kind, dice))


async def _do_nothing(_arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
    return SkillOutcome()


async def _time_listing() -> float:
    """Return the median time of a list of tools with fifty skills in it."""
    book, names = make_types(SEED, dialect=Dialect.ROS2)
    with tempfile.TemporaryDirectory() as folder:
        async with open_simulated_robot(
            Simulation(load_world("flat_1"), seed=0), clock=Clock.VIRTUAL, has_detector=False
        ) as robot:
            memory = SemanticMapStore(Path(folder) / "memory.yaml")
            server = build_server(Session(robot, memory, lease_s=60.0), tools=(), toolsets=())
            for at, name in enumerate(names[:N_LISTED]):
                spec = SkillSpec(
                    name=f"skill_{at}",
                    description=name,
                    effect=SkillEffect.READS,
                    timeout_s=1.0,
                    parameters=build_layout(book, name).parameters,
                )
                server.book.exposed[spec.name] = Skill(spec, _do_nothing)
            taken_ms: list[float] = []
            async with Client(server) as client:
                for _ in range(N_LISTINGS):
                    begun_s = time.perf_counter()
                    # Past the client's cache.
                    await client.session.list_tools()
                    taken_ms.append(1000 * (time.perf_counter() - begun_s))
    return statistics.median(taken_ms)
