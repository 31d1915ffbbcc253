"""A memory in PostgreSQL: many writers at once, and what is told when the database is away."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack, closing
from pathlib import Path
from tempfile import TemporaryDirectory

import psycopg
import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, Waypoint
from mapspeak.memory.alignment.framed import FramedMemory
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.postgres import MIGRATIONS, PostgresStore
from postgres_server import PostgresServer, run_postgres
from served import connect, report_of

pytestmark = pytest.mark.postgres


@pytest.fixture(scope="module")
def postgres() -> Iterator[PostgresServer]:
    with TemporaryDirectory() as folder, run_postgres(Path(folder)) as server:
        yield server


@pytest.fixture
def address(postgres: PostgresServer) -> str:
    return postgres.new_database()


@pytest.fixture
def store(address: str, tmp_path: Path) -> Iterator[PostgresStore]:
    with closing(open_store(address, tmp_path)) as opened:
        yield opened


def open_store(address: str, folder: Path) -> PostgresStore:
    return PostgresStore(address, path=folder / "places.yaml", map_id="b1")


def place(name: str, *things: str) -> Waypoint:
    landmarks = tuple(Landmark(label=each) for each in things)
    return Waypoint(name=name, pose=Pose(1.0, 2.0, 0.0), functional_landmarks=landmarks)


def names(store: PostgresStore) -> list[str]:
    return [each.name for each in store.read().waypoints]


def test_what_a_fleet_writes_at_once_is_all_stored(address: str, tmp_path: Path) -> None:
    def write(robot: int) -> None:
        # Each begins with a database that may have no schema yet.
        with closing(open_store(address, tmp_path)) as store:
            for number in range(4):
                store.remember(place(f"place {robot}-{number}"))
                store.remember(place("dock", f"thing {robot}-{number}"))

    with ThreadPoolExecutor(20) as pool:
        list(pool.map(write, range(20)))

    with closing(open_store(address, tmp_path)) as store:
        places = store.read()
    dock = places.find_waypoint("dock")
    assert len(places.waypoints) == 81
    assert dock is not None
    assert len(dock.landmarks) == 80


def test_a_database_that_isolates_transactions_more_than_usual_stores_all(
    address: str, tmp_path: Path
) -> None:
    with psycopg.connect(address, autocommit=True) as other:
        name = other.info.dbname
        other.execute(
            f"ALTER DATABASE {name} SET default_transaction_isolation TO serializable".encode()
        )

    def write(robot: int) -> None:
        with closing(open_store(address, tmp_path)) as store:
            store.remember(place("dock", f"thing {robot}"))

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(8)))

    with closing(open_store(address, tmp_path)) as store:
        assert len(store.read().waypoints[0].landmarks) == 8


@pytest.mark.anyio
async def test_what_one_robot_of_a_fleet_notes_the_others_find_at_once(
    address: str, tmp_path: Path
) -> None:
    async with AsyncExitStack() as fleet:
        clients = []
        for name in ("r1", "r2", "r3"):
            robot, folder = FakeRobot(two_rooms()), tmp_path / name
            map_id = robot.description.map_name
            memory = PostgresStore(address, path=folder / "places.yaml", map_id=map_id)
            fleet.push(closing(memory).__exit__)
            clients.append(await fleet.enter_async_context(connect(robot, folder, memory=memory)))
        noted = {"name": "pantry", "description": "A shelf.", "functional_landmarks": ["oven"]}
        await clients[0].call_tool("write_semantic_data", noted)
        found = [
            report_of(await client.call_tool("find_place", {"query": "the oven"}))
            for client in clients[1:]
        ]

    assert ["pantry" in str(each) for each in found] == [True, True]


def test_nothing_acknowledged_is_lost_when_the_database_falls(
    postgres: PostgresServer, store: PostgresStore
) -> None:
    memory = FramedMemory(store)
    memory.meet(two_rooms())
    store.write(place("dock"))
    store.write_event(Event(text="wet", place="C1", effect=Effect.CLOSED))
    store.read()

    postgres.stop()
    try:
        meanwhile, events = memory.read(), memory.read_events()
        with pytest.raises(SemanticMapError, match="cannot be used"):
            store.write(place("hall"))
    finally:
        postgres.start()

    assert [each.name for each in meanwhile.waypoints] == ["dock"]
    assert [each.text for each in events] == ["wet"]
    assert "the waypoints read before are given" in meanwhile.warnings[0]
    assert names(store) == ["dock"]
    assert store.read().warnings == ()
    store.write(place("hall"))
    assert names(store) == ["dock", "hall"]


def test_a_connection_that_is_cut_is_made_again(address: str, store: PostgresStore) -> None:
    store.write(place("dock"))

    with psycopg.connect(address, autocommit=True) as other:
        other.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
            " WHERE datname = current_database() AND pid <> pg_backend_pid()"
        )

    store.write(place("hall"))
    assert names(store) == ["dock", "hall"]


def test_a_wrong_password_is_told_without_it(address: str, tmp_path: Path) -> None:
    user, rest = address.split(":", 2)[1], address.split("@")[1]
    store = open_store(f"postgresql:{user}:0therSecret@{rest}", tmp_path)

    with pytest.raises(SemanticMapError) as refused:
        store.read()

    assert "password" in str(refused.value)
    assert "0therSecret" not in str(refused.value)


def test_a_database_of_a_newer_mapspeak_is_left_alone(address: str, store: PostgresStore) -> None:
    store.write(place("dock"))
    newer = len(MIGRATIONS) + 1
    with psycopg.connect(address, autocommit=True) as other:
        other.execute("UPDATE mapspeak.schema SET version = %s", (newer,))
    store.close()

    with pytest.raises(SemanticMapError, match="newer mapspeak"):
        store.write(place("hall"))


def test_a_database_that_was_half_made_is_told(address: str, store: PostgresStore) -> None:
    store.write(place("dock"))
    with psycopg.connect(address, autocommit=True) as other:
        other.execute("DELETE FROM mapspeak.schema")
    store.close()

    with pytest.raises(SemanticMapError, match="half made"):
        store.write(place("hall"))


def test_a_migration_that_fails_leaves_nothing_behind(
    store: PostgresStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = (*MIGRATIONS, "CREATE TABLE mapspeak.more (a int); SELECT 1 / 0")
    with monkeypatch.context() as patched:
        patched.setattr("mapspeak.memory.postgres.database.MIGRATIONS", broken)
        with pytest.raises(SemanticMapError, match="division by zero"):
            store.write(place("dock"))

    store.write(place("dock"))
    assert names(store) == ["dock"]


def test_a_database_whose_disk_is_full_refuses_a_write_and_takes_the_next(
    address: str, store: PostgresStore
) -> None:
    store.write(place("dock"))
    with psycopg.connect(address, autocommit=True) as other:
        other.execute(
            "CREATE FUNCTION fill() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"
            " RAISE EXCEPTION 'could not extend file: No space left on device'"
            " USING ERRCODE = 'disk_full'; END $$"
        )
        other.execute(
            "CREATE TRIGGER full_disk BEFORE INSERT ON mapspeak.records EXECUTE FUNCTION fill()"
        )

        with pytest.raises(SemanticMapError, match="No space left on device"):
            store.remember(place("hall"))
        assert names(store) == ["dock"]
        other.execute("DROP TRIGGER full_disk ON mapspeak.records")

    store.remember(place("hall"))
    assert names(store) == ["dock", "hall"]


def test_a_row_that_somebody_spoiled_is_named(
    address: str, store: PostgresStore, tmp_path: Path
) -> None:
    store.write(place("dock"))
    store.read()
    with psycopg.connect(address, autocommit=True) as other:
        other.execute(
            'UPDATE mapspeak.records SET said = \'{"name": "dock"}\','
            " changed = pg_current_xact_id() WHERE key = 'dock'"
        )

    assert names(store) == ["dock"]
    with pytest.raises(SemanticMapError, match="place 'dock'"):
        store.write(place("dock"))
    store.write(place("hall"))
    with closing(open_store(address, tmp_path)) as new:
        assert names(new) == ["hall"]
        assert "place 'dock'" in new.read().warnings[0]


def test_what_commits_late_is_read_though_later_writes_were_read_before(
    address: str, store: PostgresStore
) -> None:
    store.write(place("dock"))
    with psycopg.connect(address) as slow:
        slow.execute(
            "INSERT INTO mapspeak.records (kind, key, said) SELECT kind, 'hall', said ||"
            " '{\"name\": \"hall\"}' FROM mapspeak.records WHERE key = 'dock'"
        )
        store.write(place("ramp"))
        assert names(store) == ["dock", "ramp"]

    assert names(store) == ["dock", "hall", "ramp"]
