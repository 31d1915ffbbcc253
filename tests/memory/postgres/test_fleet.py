"""Three servers, each with a simulated robot in one building, and one memory in PostgreSQL."""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from benchmarks.talking import ServerProcess
from drawing import grid_from_text
from mapspeak.spatial.mapwriting import write_map
from postgres_server import run_postgres

pytestmark = pytest.mark.postgres

HALL = "\n".join(["#" * 80, *("#" + "." * 78 + "#" for _ in range(58)), "#" * 80])


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[ServerProcess]]:
    hall = tmp_path_factory.mktemp("fleet") / "hall.yaml"
    write_map(grid_from_text(HALL, resolution_m=0.05), hall)
    with (
        TemporaryDirectory() as folder,
        run_postgres(Path(folder)) as server,
        ExitStack() as opened,
    ):
        address = server.new_database()
        robots = []
        for seed in range(3):
            robot = ServerProcess(
                *("--robot", f"sim:{hall}", "--map", str(hall), "--seed", str(seed)),
                *("--memory", address, "--toolsets", "+memory"),
            )
            opened.callback(robot.close)
            robot.begin()
            robots.append(robot)
        yield robots


def call(robot: ServerProcess, tool: str, **arguments: object) -> str:
    result, _ = robot.call(tool, **arguments)
    assert not result.get("isError"), result
    return json.dumps(result)


def test_what_one_robot_notes_the_others_find_with_their_next_call(
    fleet: list[ServerProcess],
) -> None:
    for number, writer in enumerate(fleet):
        thing = f"{('espresso machine', 'toaster', 'fax')[number]}"
        for robot in fleet:
            assert "not remembered" in call(robot, "find_place", query=thing).casefold()

        call(
            writer,
            "write_semantic_data",
            name=f"place of robot {number}",
            description="A corner of the hall.",
            functional_landmarks=[{"label": thing, "bearing_deg": 0.0, "range_m": 1.0}],
        )

        for robot in fleet:
            found = call(robot, "find_place", query=thing)
            assert "not remembered" not in found.casefold()
            assert thing in found


def test_what_one_robot_is_told_of_a_closed_place_holds_for_all(
    fleet: list[ServerProcess],
) -> None:
    call(fleet[0], "note_event", text="the floor is wet", place="R1", effect="slow")

    for robot in fleet:
        assert "the floor is wet" in call(robot, "look_at_map")
