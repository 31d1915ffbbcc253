"""The scripted policy's diagnoses of a ROS, each from what the ros tools answer."""

import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from itertools import pairwise

from mapspeak.evaluation.agent import AgentEnd, ToolClient
from mapspeak.evaluation.trials import TrialState

OURSELVES = "/rosbridge_websocket"
FIELD = re.compile(r"^(\w+): (\S+)", re.MULTILINE)
PARAMETER = re.compile(r"^(\w+): (-?[\d.]+)(?: |$)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class RosReader:
    """Calls the ros tools in a script's name."""

    tools: ToolClient

    async def ask(self, tool: str, **arguments: object) -> str:
        """Return the text of an answer."""
        return (await self.tools.demand(tool, **arguments)).text

    async def list_topics(self, type_ending: str = "") -> list[str]:
        """Return the topics whose type ends so."""
        lines = [line.split() for line in (await self.ask("ros_topics")).splitlines()[1:]]
        ending = f"/{type_ending}" if type_ending else ""
        return [line[0] for line in lines if line[1].endswith(ending)]

    async def fetch_nodes(self, topic: str) -> tuple[list[str], list[str]]:
        """Return who publishes a topic and who subscribes to it, but for what we look through."""
        text = await self.ask("ros_topic", topic=topic)
        said = (_first(rf"(?m)^{what}: (.*)$", text) for what in ("published by", "heard by"))
        # What a node does for us is marked behind its name.
        named = [[each.partition(" ")[0] for each in nodes.split(", ")] for nodes in said]
        publishers, subscribers = (
            [each for each in nodes if each.startswith("/") and each != OURSELVES]
            for nodes in named
        )
        return publishers, subscribers

    async def fetch_time_s(self) -> float:
        """Return the robot's time; 0 where it does not say."""
        return float(_first(r"robot time (\d+(?:\.\d+)?) s", await self.ask("ros_overview")) or 0)

    async def read(self, topic: str, **how: object) -> str:
        """Return what ros_read says of a topic; nothing where nothing came."""
        answer = await self.tools.call("ros_read", topic=topic, **how)
        return "" if answer.is_error else answer.text


RATE_OVER_S = 5.0
SILENT_AFTER_S = 3.0
"""The slowest of the robot's sensors comes twice a second."""
TRANSFORMS_OVER_S = 1.5
N_TRANSFORMS = 10
LATE_S = 5.0
NAME = r"/[\w/]*\w"
SERVICE_WORDS = {
    "odometry": "odom",
    "motors": "motor",
    "costmap": "costmap",
    "the map": "map",
    "inertial": "imu",
}
"""A word of the question, and one of the services' names; the first that fits counts."""

Diagnosis = Callable[[RosReader, str], Awaitable[str | None]]


async def diagnose(tools: ToolClient, question: str) -> AgentEnd:
    """Answer a question about the robot's ROS in the form that it asks for."""
    reader = RosReader(tools)
    for pattern, find_out in DIAGNOSES:
        if re.search(pattern, question):
            said = await find_out(reader, question)
            if said is not None:
                return AgentEnd(answer=f"ANSWER: {said}")
    return AgentEnd(answer="I found nothing out of order.", state=TrialState.GAVE_UP)


# --- who does what ---------------------------------------------------------------------------


async def _say_velocity(reader: RosReader, question: str) -> str | None:
    topic = _first(rf"velocities on ({NAME})", question)
    publishers, subscribers = await reader.fetch_nodes(topic)
    return ", ".join((*publishers[:1], *subscribers[:1]))


async def _say_fight(reader: RosReader, _question: str) -> str | None:
    for topic in await reader.list_topics("Twist"):
        publishers, _ = await reader.fetch_nodes(topic)
        if len(publishers) > 1:
            return ", ".join(publishers)
    return None


async def _say_unheard(reader: RosReader, _question: str) -> str | None:
    for topic in await reader.list_topics():
        publishers, subscribers = await reader.fetch_nodes(topic)
        if publishers and not subscribers:
            return topic
    return None


async def _say_missing(reader: RosReader, question: str) -> str | None:
    launched = re.findall(NAME, _first(r"starts the nodes (.+?)\. One", question))
    running = (await reader.ask("ros_nodes")).splitlines()[1:]
    missing = [node for node in launched if node not in running]
    for topic in await reader.list_topics() if missing else ():
        publishers, subscribers = await reader.fetch_nodes(topic)
        if subscribers and not publishers:
            return f"{missing[0]}, {topic}"
    return None


async def _say_remap(reader: RosReader, question: str) -> str | None:
    node = _first(rf"yet ({NAME}) gets no scans", question)
    wanted = _first(r"(?m)^hears: (.*)$", await reader.ask("ros_node", node=node)).split(", ")
    scans = {
        topic: (await reader.fetch_nodes(topic))[0]
        for topic in await reader.list_topics("LaserScan")
    }
    waits = next((topic for topic, by in scans.items() if topic in wanted and not by), None)
    comes = next((topic for topic, by in scans.items() if by), None)
    return None if waits is None or comes is None else f"{waits}, {comes}"


async def _say_parameter(reader: RosReader, question: str) -> str | None:
    node = _first(rf"the parameters of ({NAME}) are", question)
    sheet = re.findall(r"(\w+) ([\d.]+\d|\d)(?=,|\.)", _first(r"are: (.+?\.) One", question))
    values = dict(PARAMETER.findall(await reader.ask("ros_parameters", node=node)))
    for name, right in sheet:
        value = float(values.get(name, right))
        if abs(value - float(right)) > 1e-3 * abs(value):
            return f"{name}, {value:g}"
    return None


async def _say_service(reader: RosReader, question: str) -> str | None:
    word = next(there for here, there in SERVICE_WORDS.items() if here in question)
    for name in (await reader.ask("ros_services", filter=word)).splitlines()[1:]:
        last = name[1:].partition("/")[2]
        is_other = word == "map" and "costmap" in last
        if word in last and not is_other and "parameter" not in last:
            text = await reader.ask("ros_service", service=name)
            return f"{name}, {text.splitlines()[0].split()[1]}"
    return None


async def _say_type(reader: RosReader, question: str) -> str | None:
    text = await reader.ask("ros_topic", topic=_first(rf"messages on ({NAME})", question))
    kind = _first(r"of the type (\w+)\?", question)
    fields = FIELD.findall(text.partition("heard by: ")[2].partition("\n")[2])
    return ", ".join(name for name, each in fields if each == kind) or None


# --- what is published -----------------------------------------------------------------------


async def _say_map(reader: RosReader, _question: str) -> str | None:
    found: list[tuple[float, str]] = []
    for topic in await reader.list_topics("OccupancyGrid"):
        text = await reader.read(topic)
        match = re.search(r"Grid of (\d+) x (\d+) cells of ([\d.]+) m", text)
        if match is not None:
            n_cols, n_rows, resolution_m = int(match[1]), int(match[2]), float(match[3])
            said = f"{topic}, {n_cols} x {n_rows}, {resolution_m:g} m"
            found.append((n_cols * n_rows * resolution_m**2, said))
    return max(found)[1] if found else None


async def _say_rate(reader: RosReader, _question: str) -> str | None:
    for topic in await reader.list_topics("LaserScan"):
        text = await reader.read(topic, duration_s=RATE_OVER_S)
        match = re.search(r"(\d+) messages in ([\d.]+) s", text)
        if match is not None:
            return f"{topic}, {int(match[1]) / float(match[2]):.2f} Hz"
    return None


async def _say_silent(reader: RosReader, question: str) -> str | None:
    names: list[str] = re.findall(NAME, _first(r"publish on (.+?)\. Which", question))
    for name in names:
        if not await reader.read(name, wait_s=SILENT_AFTER_S):
            return name
    return None


async def _say_battery(reader: RosReader, question: str) -> str | None:
    least = float(_first(r"below (\d+) %", question))
    for topic in await reader.list_topics("BatteryState"):
        if share := _first(r"(?m)^percentage: ([\d.]+)", await reader.read(topic)):
            charge = 100 * float(share)
            return f"{charge:.0f} %, {'charge' if charge < least else 'stay'}"
    return None


async def _say_clock(reader: RosReader, question: str) -> str | None:
    lags: list[tuple[float, str]] = []
    for name in re.findall(NAME, _first(r"publish on (.+?)\. On which", question)):
        stamp = _first(r"stamp: ([\d.]+) s", await reader.read(name))
        if stamp:
            lag_s = await reader.fetch_time_s() - float(stamp)
            lags.append((lag_s, name))
    return f"{max(lags)[1]}, {max(lags)[0]:.1f} s" if lags else None


async def _say_transform(reader: RosReader, question: str) -> str | None:
    chain = _first(r": ([\w, ]+)\. Is the chain", question).split(", ")
    moving = await reader.read("/tf", n=N_TRANSFORMS, duration_s=TRANSFORMS_OVER_S)
    now_s = await reader.fetch_time_s()
    fixed = await reader.read("/tf_static")
    for parent, child in pairwise(chain):
        link = rf"^{parent} -> {child}: .*\(([\d.]+) s\)$"
        stamps = [float(stamp) for stamp in re.findall(link, moving, re.MULTILINE)]
        if stamps and now_s - max(stamps) > LATE_S:
            return f"{parent} -> {child}, late"
        if not stamps and not re.search(link, fixed, re.MULTILINE):
            return f"{parent} -> {child}, missing"
    return "whole"


def _first(pattern: str, text: str) -> str:
    match = re.search(pattern, text)
    return "" if match is None else match[1]


DIAGNOSES: tuple[tuple[str, Diagnosis], ...] = (
    (r"Which node sends velocities on", _say_velocity),
    (r"Which two nodes both send", _say_fight),
    (r"published and no node hears it", _say_unheard),
    (r"launch file starts the nodes", _say_missing),
    (r"gets no scans", _say_remap),
    (r"By the robot's data sheet", _say_parameter),
    (r"Which service", _say_service),
    (r"Which fields of the messages", _say_type),
    (r"carries the map", _say_map),
    (r"how many scans a second", _say_rate),
    (r"nothing comes from it", _say_silent),
    (r"How full is the battery", _say_battery),
    (r"The clock of one sensor", _say_clock),
    (r"Transforms should lead", _say_transform),
)
