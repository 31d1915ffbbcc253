"""How a drive ends when a part of its robot is away for a while, and whether that is told truly.

`python -m benchmarks.outages [SECONDS]... [--part PART]... [--ros DIALECT]...` takes each part away
during a drive, for 1, 5, 14, 26 and 60 s unless other times are given, from a robot behind
rosbridge that is ROS 1 and ROS 2, and prints what became of each drive as it ends. The variable
MAPSPEAK_BENCH_OUTAGES holds the same arguments for `./run bench outages`. What counts is how long
the robot truly drove, once the part was back, while the last answer said that the drive was over.
"""

import os
import shlex
import sys
from collections.abc import AsyncGenerator, Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import anyio
import click
import numpy as np
from anyio.abc import ByteStream, SocketAttribute

from benchmarks.figure import Figure
from mapspeak.driving.drivereport import DriveReport
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import GoalState
from mapspeak.ros.messages.fields import Dialect
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid

__all__ = ["main", "measure"]

AWAY_S = (1.0, 5.0, 14.0, 26.0, 60.0)
N_AT_ONCE = 4
N_TRIES = 2
SPEED_MPS = 0.5
DRIVES_S = 3.0
"""Before the part goes away."""
GOES_ON_S = 10.0
"""After the part is back a drive that nobody stops would last so long."""
WATCHED_S = 15.0
LOOK_S = 0.1
STILL_M = 0.005
"""What moves less between two looks stands."""
CELL_M = 0.25


class Part(StrEnum):
    """What goes away."""

    ROSBRIDGE = "rosbridge"
    NETWORK = "network"
    ROBOT = "robot"
    NAVIGATION = "navigation"
    TF = "tf"
    CLOCK = "clock"


class Wire:
    """A TCP connection to the robot on which nothing comes through while it is cut."""

    def __init__(self, port: int) -> None:
        self._far_port = port
        self._is_whole = anyio.Event()
        self._is_whole.set()
        self.port = 0

    def cut(self) -> None:
        """Hold back whatever is sent, as a network does that is away."""
        self._is_whole = anyio.Event()

    def mend(self) -> None:
        """Let through what was held back, and what follows."""
        self._is_whole.set()

    async def carry(self, near: ByteStream) -> None:
        """Carry one connection until one of its ends closes it."""
        try:
            far = await anyio.connect_tcp("127.0.0.1", self._far_port)
        except OSError:
            await near.aclose()
            return
        async with near, far, anyio.create_task_group() as tasks:
            tasks.start_soon(self._pass_on, near, far, tasks.cancel_scope)
            tasks.start_soon(self._pass_on, far, near, tasks.cancel_scope)

    async def _pass_on(self, one: ByteStream, other: ByteStream, scope: anyio.CancelScope) -> None:
        try:
            while True:
                data = await one.receive()
                await self._is_whole.wait()
                await other.send(data)
        except (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError):
            scope.cancel()


@dataclass(slots=True)
class Course:
    """What became of one drive.

    Attributes:
        dialect: Of the robot.
        part: What went away.
        away_s: For how long.
        told: What the answers said, one after the other, without repetition.
        wrongly_s: The longest time it drove while told otherwise, once the part was back.
        stood_s: When it stood for good, from the part's return on; None where it never did.
        drove_m: How far it drove after the return.
        longest_answer_s: For the slowest answer.
    """

    dialect: Dialect
    part: Part
    away_s: float
    told: list[str] = field(default_factory=list)
    wrongly_s: float = 0.0
    stood_s: float | None = None
    drove_m: float = 0.0
    longest_answer_s: float = 0.0

    @property
    def name(self) -> str:
        """Which drive it was."""
        return f"{self.dialect} without {self.part} for {self.away_s:g} s"


@asynccontextmanager
async def open_wire(port: int) -> AsyncGenerator[Wire]:
    """Offer a wire to a port of this machine."""
    listener: Any = await anyio.create_tcp_listener(local_host="127.0.0.1")
    wire = Wire(port)
    wire.port = listener.extra(SocketAttribute.local_port)  # noqa: S610 - no SQL
    async with listener, anyio.create_task_group() as tasks:
        tasks.start_soon(listener.serve, wire.carry)
        yield wire
        tasks.cancel_scope.cancel()


def draw_corridor(length_m: float) -> OccupancyGrid:
    """Return a corridor along x."""
    cells = np.zeros((16, round(length_m / CELL_M)), dtype=np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    return OccupancyGrid(cells=cells, resolution_m=CELL_M, origin=Pose(0.0, 0.0))


async def take_away(bridge: Any, wire: Wire, part: Part) -> None:  # noqa: ANN401 - of the tests
    """Let a part of the robot fail."""
    match part:
        case Part.ROSBRIDGE:
            await bridge.close()
        case Part.NETWORK:
            wire.cut()
        case Part.ROBOT:
            bridge.robot.base.has_power = False
            bridge.ros.kill(bridge.ros.navigator)
            await bridge.close()
        case Part.NAVIGATION:
            bridge.ros.kill(bridge.ros.navigator)
        case Part.TF:
            bridge.robot.faults.silent.add("/tf")
        case Part.CLOCK:
            bridge.robot.faults.is_paused = True


async def bring_back(bridge: Any, wire: Wire, part: Part) -> None:  # noqa: ANN401 - of the tests
    """Let the part work again."""
    match part:
        case Part.ROSBRIDGE:
            await bridge.open()
        case Part.NETWORK:
            wire.mend()
        case Part.ROBOT:
            bridge.robot.base.has_power = True
            bridge.ros.start(bridge.ros.navigator)
            await bridge.open()
        case Part.NAVIGATION:
            bridge.ros.start(bridge.ros.navigator)
        case Part.TF:
            bridge.robot.faults.silent.discard("/tf")
        case Part.CLOCK:
            bridge.robot.faults.is_paused = False


class Witness:
    """Asks about a drive again and again, and sees beside it what the robot truly does."""

    def __init__(self, session: Session, course: Course, pose: Callable[[], Pose]) -> None:
        self._session = session
        self._course = course
        self._pose = pose
        self._back_s: float | None = None
        self._is_over = False

    def part_is_back(self) -> None:
        """Count from now on what is told wrongly."""
        self._back_s = anyio.current_time()

    async def ask(self) -> None:
        """Note what the answers say, until cancelled."""
        while True:
            begun_s = anyio.current_time()
            report = await self._session.drives.report()
            took_s = anyio.current_time() - begun_s
            self._course.longest_answer_s = max(self._course.longest_answer_s, took_s)
            self._is_over = report.status.state.is_final
            said = _say(report)
            if [said] != self._course.told[-1:]:
                self._course.told.append(said)
            await anyio.sleep(LOOK_S)

    async def see(self) -> None:
        """Note how the robot drives, until cancelled."""
        course, before, wrong_since_s = self._course, self._pose(), None
        while True:
            await anyio.sleep(LOOK_S)
            now_s, here = anyio.current_time(), self._pose()
            step_m, before = before.point.distance_to(here.point), here
            if self._back_s is None:
                continue
            course.drove_m += step_m
            is_driving = step_m > STILL_M
            if is_driving:
                course.stood_s = None
            elif course.stood_s is None:
                course.stood_s = now_s - self._back_s
            if not (is_driving and self._is_over):
                wrong_since_s = None
                continue
            wrong_since_s = now_s - LOOK_S if wrong_since_s is None else wrong_since_s
            course.wrongly_s = max(course.wrongly_s, now_s - max(wrong_since_s, self._back_s))


def _say(report: DriveReport) -> str:
    said = str(report.status.state)
    if report.status.state is GoalState.ACCEPTED:
        said = str(GoalState.DRIVING)
    doubt = f" ({report.pose_doubt})" if report.pose_doubt else ""
    return f"{said}{doubt}{', stop owed' if report.is_stop_owed else ''}"


async def run(course: Course, folder: Path) -> None:
    """Take a part away during a drive, and note what becomes of it."""
    from faulty_bridge import open_faulty_bridge  # noqa: PLC0415 - of the tests' folder

    length_m = SPEED_MPS * (DRIVES_S + course.away_s + GOES_ON_S)
    start, goal = Pose(2.0, 2.0), Pose(2.0 + length_m, 2.0)
    async with (
        open_faulty_bridge(
            course.dialect, grid=draw_corridor(length_m + 4.0), pose=start, speed_mps=SPEED_MPS
        ) as bridge,
        open_wire(bridge.port) as wire,
        open_rosbridge_robot(f"ws://127.0.0.1:{wire.port}") as robot,
        anyio.create_task_group() as tasks,
    ):
        session = Session(robot, SemanticMapStore(folder / "map.yaml"), lease_s=3600.0)
        # Somebody is there all the time.
        with session.client_is_heard():
            tasks.start_soon(session.keep_watch)
            with session.drives.preparing() as ticket:
                await session.drives.start(goal, place="the end", ticket=ticket)
            witness = Witness(session, course, lambda: bridge.robot.base.pose)
            tasks.start_soon(witness.ask)
            tasks.start_soon(witness.see)
            await anyio.sleep(DRIVES_S)
            await take_away(bridge, wire, course.part)
            await anyio.sleep(course.away_s)
            await bring_back(bridge, wire, course.part)
            witness.part_is_back()
            await anyio.sleep(WATCHED_S)
        tasks.cancel_scope.cancel()


def run_case(course: Course) -> Course:
    """Run one case with the robot of the tests, in a process of its own."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    with TemporaryDirectory() as folder:
        anyio.run(run, course, Path(folder))
    return course


def list_cases(
    away_s: Sequence[float], parts: Sequence[Part], dialects: Sequence[Dialect]
) -> list[Course]:
    """Return every case, the longest first."""
    return [
        Course(dialect, part, each)
        for each in sorted(away_s, reverse=True)
        for dialect in dialects
        for part in parts
    ]


def run_all(
    cases: Sequence[Course], run_one: Callable[[Course], Course] = run_case
) -> Iterator[Course]:
    """Run each case in a process of its own, a few at once, and yield it as it ends.

    A case whose process died is run once again, and is an error when it dies again.
    """
    with ThreadPoolExecutor(N_AT_ONCE) as threads:
        for done in as_completed([threads.submit(_run_apart, each, run_one) for each in cases]):
            yield done.result()


def _run_apart(course: Course, run_one: Callable[[Course], Course]) -> Course:
    for n_left in reversed(range(N_TRIES)):
        # Cases that run beside this one keep their own processes when this one's dies.
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
            try:
                return process.submit(run_one, course).result()
            except BrokenProcessPool:
                if not n_left:
                    raise
                click.echo(f"{course.name}: its process died; once again", err=True)
    raise AssertionError


def measure() -> Iterator[Figure]:
    """Measure how long the robot drives while told otherwise."""
    arguments = shlex.split(os.environ.get("MAPSPEAK_BENCH_OUTAGES", ""))
    for course in run_all(choose(**main.make_context("outages", arguments).params)):
        click.echo(describe(course), err=True)
        yield Figure(name=f"{course.name}: driven wrongly", value=course.wrongly_s, unit="s")


def describe(course: Course) -> str:
    """Return what became of a drive, on one line."""
    stood = "never stood" if course.stood_s is None else f"stood after {course.stood_s:.1f} s"
    return (
        f"{course.name}: {' > '.join(course.told)}; {stood}, drove {course.drove_m:.1f} m, "
        f"wrongly {course.wrongly_s:.1f} s, slowest answer {course.longest_answer_s:.1f} s"
    )


@click.command()
@click.argument("away_s", nargs=-1, type=float, metavar="[SECONDS]...")
@click.option(
    "--part",
    "parts",
    multiple=True,
    type=click.Choice([each.value for each in Part]),
    help="All, if none.",
)
@click.option(
    "--ros",
    "dialects",
    multiple=True,
    type=click.Choice([each.value for each in Dialect]),
    help="Likewise.",
)
def main(away_s: tuple[float, ...], parts: tuple[str, ...], dialects: tuple[str, ...]) -> None:
    """Print what became of each drive."""
    for course in run_all(choose(away_s, parts, dialects)):
        click.echo(describe(course))


def choose(away_s: Sequence[float], parts: Sequence[str], dialects: Sequence[str]) -> list[Course]:
    """Return the cases that arguments name."""
    return list_cases(
        away_s or AWAY_S,
        [Part(each) for each in parts] or list(Part),
        [Dialect(each) for each in dialects] or list(Dialect),
    )


if __name__ == "__main__":
    main()
