"""What a memory loses when its writers are killed at any point of their writes: nothing.

A writer changes a place in the YAML file, then keeps an observation with a picture, and tells of
each when it returned. Its clock runs so fast that old pictures are thinned meanwhile. It is killed
at every step that Python asks of the system in turn, and from outside at any moment. After each
death the file must be whole, hold every acknowledged place, and the episodes every acknowledged
observation, with its picture unless the rule has dropped it. Then two writers at once.
`python -m benchmarks.memory_crashes --kills 12` is quick. It forks: a program of its own.
"""

import contextlib
import json
import os
import random
import signal
import sqlite3
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from itertools import count
from pathlib import Path
from typing import TextIO

import click

from benchmarks.figure import Figure
from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore, Waypoint
from mapspeak.memory.episodes.observation import EpisodeQuery, Observation, ObservationKind
from mapspeak.memory.episodes.pictures import ThinningRule
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder

__all__ = ["main", "measure"]

N_KILLS = 1000
N_PLACES = 20
START = datetime(2026, 11, 2, tzinfo=UTC)
LOCK_TIMEOUT_S = 60.0


@dataclass(slots=True)
class Tally:
    """What was acknowledged, and what was amiss.

    Attributes:
        rounds: The last acknowledged round of each place.
        observation_ids: All that were acknowledged.
        n_kills: Writers that died.
        n_places: Acknowledged changes of places.
        faults: What was lost or not whole.
    """

    rounds: dict[str, int] = field(default_factory=dict)
    observation_ids: list[str] = field(default_factory=list)
    n_kills: int = 0
    n_places: int = 0
    faults: list[str] = field(default_factory=list)

    def note(self, line: str) -> None:
        """Take what a writer told."""
        what, said = line.split()
        if what == "place":
            self.rounds[place_name(int(said))] = int(said)
            self.n_places += 1
        else:
            self.observation_ids.append(said)


def place_name(number: int) -> str:
    """Return the place that a round changes."""
    return f"place {number % N_PLACES}"


def measure(n_kills: int = N_KILLS) -> Iterator[Figure]:
    """Return how many writers were killed, and what was lost."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "places.yaml"
        tally = Tally()
        for kill in (kill_at_steps, kill_at_moments):
            before = tally.n_kills
            kill(path, tally, n_kills)
            yield _figure(kill.__name__.replace("_", " "), tally.n_kills - before)
        yield _figure("places acknowledged", tally.n_places)
        yield _figure("observations acknowledged", len(tally.observation_ids))
        check_all(path, tally)
        n_each = max(n_kills // 10, 10)
        yield _figure("written by two at once, each", n_each)
        write_at_once(path.with_name("two.yaml"), tally, n_each)
        yield _figure("lost, or not whole", len(tally.faults))
        for fault in tally.faults[:5]:
            click.echo(fault, err=True)


def kill_at_steps(path: Path, tally: Tally, n_kills: int) -> None:
    """Writer die, each a step further into its round; then from the first step again."""
    step = 0
    for number in range(n_kills):
        step += 1
        with told_by(lambda end, n=number, s=step: write_and_die(path, n, s, end)) as (lines, _):  # type: ignore[misc]
            for line in lines:
                if line.endswith("finished\n"):
                    step = 0
                else:
                    tally.note(line)
        tally.n_kills += step > 0
        check_last(path, tally)


def kill_at_moments(path: Path, tally: Tally, n_kills: int) -> None:
    """Writer that write all the time are killed from outside."""
    chance = random.Random(7)  # noqa: S311 - no secret
    for number in range(n_kills):
        first = (number + 1) * 1_000_000
        with told_by(lambda end, n=first: write_forever(path, n, end)) as (lines, process_id):  # type: ignore[misc]
            for _ in range(chance.randrange(1, 4)):
                tally.note(lines.readline())
            for _ in range(chance.randrange(400_000)):
                pass
            os.kill(process_id, signal.SIGKILL)
            for line in lines:
                if line.endswith("\n"):
                    tally.note(line)
        tally.n_kills += 1
        check_last(path, tally)


def write_at_once(path: Path, tally: Tally, n_each: int) -> None:
    """Two processes write places and observations as fast as they can."""

    def work(side: int, end: int) -> None:
        for i in range(n_each):
            number = side * n_each + i
            write_place(path, number, name=f"place {number}")
            write_observation(path, number)
        os.write(end, b"done\n")

    with (
        told_by(lambda end: work(0, end)) as (left, _),
        told_by(lambda end: work(1, end)) as (
            right,
            _,
        ),
    ):
        told = left.readline() + right.readline()
    n_places = len(SemanticMapStore(path).read().waypoints)
    n_observations = EpisodeStore(memory_folder(path)).find(EpisodeQuery()).n_matches
    if (told, n_places, n_observations) != ("done\ndone\n", 2 * n_each, 2 * n_each):
        tally.faults.append(f"at once: {n_places} places, {n_observations} observations")


# --- writers ---------------------------------------------------------------------------------


def write_place(path: Path, number: int, *, name: str | None = None) -> None:
    """Change a place, from a store that knows nothing yet."""
    store = SemanticMapStore(path, map_id="b1", lock_timeout_s=LOCK_TIMEOUT_S)
    place = Waypoint(
        name=name or place_name(number), pose=Pose(1.0, 2.0), description=f"round {number}"
    )
    store.write(place)


def write_observation(path: Path, number: int) -> str:
    """Keep an observation with a picture of its own, and return its id."""
    store = EpisodeStore(memory_folder(path), lock_timeout_s=LOCK_TIMEOUT_S)
    observation = Observation(
        recorded_at=START + timedelta(milliseconds=number),
        pose=Pose(number % 7, 2.0),
        kind=ObservationKind.PICTURE,
        text=f"round {number}",
    )
    return store.write(observation, picture=b"\xff\xd8\xff" + f"{number}".encode() * 999).id


def write_round(path: Path, number: int, end: int) -> None:
    """Write both, and tell of each."""
    write_place(path, number)
    os.write(end, f"place {number}\n".encode())
    observation_id = write_observation(path, number)
    os.write(end, f"observation {observation_id}\n".encode())


def write_forever(path: Path, number: int, end: int) -> None:
    """Write round after round."""
    for n in count(number):
        write_round(path, n, end)


def write_and_die(path: Path, number: int, n_steps: int, end: int) -> None:
    """Write a round, and dies at the n-th thing that Python asks of the system."""
    steps = count(1)

    def die(event: str, _arguments: tuple[object, ...]) -> None:
        if event.startswith(("open", "os.", "fcntl.", "sqlite3.")) and next(steps) == n_steps:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(die)
    write_round(path, number, end)
    os.write(end, b"finished\n")


@contextlib.contextmanager
def told_by(work: Callable[[int], None]) -> Iterator[tuple[TextIO, int]]:
    """Start a process, and return the lines that it tells and its id; wait for its end."""
    reading, writing = os.pipe()
    process_id = os.fork()
    if process_id == 0:
        work(writing)
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as lines:
        yield lines, process_id
    os.waitpid(process_id, 0)


# --- checks ----------------------------------------------------------------------------------


def check_last(path: Path, tally: Tally) -> None:
    """Look whether the file is whole, and what was acknowledged last is there."""
    try:
        check_places(path, tally)
    except SemanticMapError as error:
        tally.faults.append(f"after {tally.n_kills} kills: {error}")
    episodes = EpisodeStore(memory_folder(path))
    for observation_id in tally.observation_ids[-2:]:
        if not is_kept(episodes, observation_id):
            tally.faults.append(f"after {tally.n_kills} kills: {observation_id} is lost")


def check_places(path: Path, tally: Tally) -> None:
    """Look whether each place says its last acknowledged round, or the one that was under way."""
    places = SemanticMapStore(path).read() if path.exists() else None
    for name, number in tally.rounds.items():
        place = places.find_waypoint(name) if places else None
        if place is None or int(place.description.removeprefix("round ")) < number:
            tally.faults.append(f"after {tally.n_kills} kills: round {number} of {name} is lost")


def check_all(path: Path, tally: Tally) -> None:
    """Look for every observation and picture, and into every page of the database."""
    episodes = EpisodeStore(memory_folder(path))
    for observation_id in tally.observation_ids:
        if not is_kept(episodes, observation_id):
            tally.faults.append(f"{observation_id} is lost")
    with contextlib.closing(sqlite3.connect(episodes.database.path)) as connection:
        said = connection.execute("PRAGMA integrity_check").fetchone()[0]
    found = episodes.find(EpisodeQuery(words="round")).n_matches
    n_kept = episodes.find(EpisodeQuery()).n_matches
    if said != "ok" or found != n_kept:
        tally.faults.append(f"the database: {said}; its index finds {found} of {n_kept}")


def is_kept(episodes: EpisodeStore, observation_id: str) -> bool:
    """Look for an observation, and for its picture unless the rule has dropped it by now."""
    observation = episodes.get(observation_id)
    if observation is None:
        return False
    if observation.picture is None:
        newest = episodes.find(EpisodeQuery(limit=1)).matches[0].observation
        return newest.recorded_at - observation.recorded_at > ThinningRule().all_for
    picture = episodes.picture_path(observation)
    return picture is not None and picture.stat().st_size > 999


def _figure(name: str, value: int) -> Figure:
    return Figure(name=name, value=value, unit="")


@click.command()
@click.option("--kills", default=N_KILLS, show_default=True, help="Of each sort.")
@click.option("--json", "as_json", is_flag=True, help="As JSON.")
def main(kills: int, *, as_json: bool) -> None:
    """Kill writers, and shows what was lost."""
    figures = {figure.name: int(figure.value) for figure in measure(kills)}
    if as_json:
        click.echo(json.dumps(figures))
        return
    for name, value in figures.items():
        click.echo(f"{name:>28}  {value:,}")


if __name__ == "__main__":
    main()
