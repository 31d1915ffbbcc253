import os
import signal
import stat
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from filelock import FileLock

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, SemanticMap, SemanticMapStore, Waypoint
from mapspeak.memory.durable import MAX_BYTES, DurableFile

IS_ROOT = hasattr(os, "geteuid") and os.geteuid() == 0

BROKEN = "waypoints:\n  - name: dock\n    pose: {x: 1, y: 2\n"


def place(name: str, x: float = 1.0) -> Waypoint:
    return Waypoint(name=name, pose=Pose(x, 2.0, 0.0))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "places.yaml"


@pytest.fixture
def store(path: Path) -> SemanticMapStore:
    return SemanticMapStore(path, map_id="b1")


def names(store: SemanticMapStore) -> list[str]:
    return [place.name for place in store.read().waypoints]


# --- writing and reading ---------------------------------------------------------------------


def test_a_store_without_a_file_is_an_empty_map_and_makes_none(
    store: SemanticMapStore, path: Path
) -> None:
    assert store.read().waypoints == ()
    assert list(path.parent.iterdir()) == []


def test_an_edit_in_place_of_the_same_size_and_time_is_seen(
    store: SemanticMapStore, path: Path
) -> None:
    store.write(place("dock"))
    before = path.stat()
    path.write_text(path.read_text().replace("dock", "hall"))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))

    assert names(store) == ["hall"]
    store.write(place("sink"))
    assert names(SemanticMapStore(path, map_id="b1")) == ["hall", "sink"]


def test_an_edit_by_hand_is_seen(store: SemanticMapStore, path: Path) -> None:
    store.write(place("dock"))

    path.write_text(path.read_text().replace("name: dock", "name: loading dock  # renamed"))

    assert names(store) == ["loading dock"]
    store.write(place("loading dock", x=9.0))
    assert "name: loading dock  # renamed\n" in path.read_text()


def test_an_unchanged_file_is_not_read_again(store: SemanticMapStore) -> None:
    store.write(place("dock"))

    assert store.read().waypoints[0] is store.read().waypoints[0]


def test_the_folder_is_made_where_it_is_missing(tmp_path: Path) -> None:
    store = SemanticMapStore(tmp_path / "robots" / "r1" / "places.yaml")

    store.write(place("dock"))

    assert names(store) == ["dock"]


# --- maps ------------------------------------------------------------------------------------


def test_a_file_that_names_no_map_takes_the_one_of_its_first_writer(
    store: SemanticMapStore, path: Path
) -> None:
    path.write_text("waypoints:\n  - {name: dock, pose: {x: 0, y: 0, yaw_deg: 0}}\n")
    assert store.read().warnings == ()

    store.write(place("hall"))

    assert path.read_text().startswith("map: b1\nwaypoints:\n")
    assert {place.map_id for place in store.read().waypoints} == {"b1"}


# --- files that are wrong --------------------------------------------------------------------


def test_a_file_that_was_never_right_is_an_error(store: SemanticMapStore, path: Path) -> None:
    path.write_text(BROKEN)

    for _ in range(2):
        with pytest.raises(SemanticMapError, match="line 4, column 1"):
            store.read()


def test_a_file_broken_by_hand_gives_the_places_read_before_and_is_not_written_to(
    store: SemanticMapStore, path: Path
) -> None:
    store.write(place("dock"))
    path.write_text(BROKEN)

    places = store.read()
    assert [place.name for place in places.waypoints] == ["dock"]
    assert "line 4, column 1" in places.warnings[0]
    with pytest.raises(SemanticMapError, match="line 4, column 1"):
        store.write(place("hall"))
    assert path.read_text() == BROKEN

    path.write_text(BROKEN.replace("y: 2", "y: 2, yaw_deg: 0}"))
    store.write(place("hall"))
    assert names(store) == ["dock", "hall"]
    assert store.read().warnings == ()


def test_a_folder_in_place_of_the_file_is_an_error(tmp_path: Path) -> None:
    store = SemanticMapStore(tmp_path)

    with pytest.raises(SemanticMapError, match="is a folder"):
        store.read()
    with pytest.raises(SemanticMapError, match="is a folder"):
        store.write(place("dock"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_in_place_of_the_file_is_an_error(path: Path, store: SemanticMapStore) -> None:
    os.mkfifo(path)

    with pytest.raises(SemanticMapError, match="no ordinary file"):
        store.read()


def test_a_file_that_is_too_large_is_refused(store: SemanticMapStore, path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)

    with pytest.raises(SemanticMapError, match=r"has 20\.0 MB; at most 20 MB"):
        store.read()


def test_a_path_through_a_file_is_an_error(path: Path) -> None:
    path.write_text("")
    store = SemanticMapStore(path / "places.yaml")

    with pytest.raises(SemanticMapError, match="Cannot read"):
        store.read()
    with pytest.raises(SemanticMapError, match=r"Cannot lock .*Check that"):
        store.write(place("dock"))


def test_a_write_that_fails_leaves_the_file_as_it_was(store: SemanticMapStore, path: Path) -> None:
    store.write(place("dock"))
    before = path.read_bytes()
    (path.parent / ".places.yaml.tmp").mkdir()

    with pytest.raises(SemanticMapError, match="Cannot write"):
        store.write(place("hall"))
    assert path.read_bytes() == before
    assert names(store) == ["dock"]


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of processes")
def test_a_disk_that_is_full_leaves_the_file_as_it_was(store: SemanticMapStore, path: Path) -> None:
    import resource  # noqa: PLC0415 - there is none on Windows

    store.write(place("dock"))
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before), limits[1]))
    try:
        with pytest.raises(SemanticMapError, match="Cannot write"):
            store.write(place("hall"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)

    assert path.read_bytes() == before
    store.write(place("hall"))
    assert names(store) == ["dock", "hall"]


@pytest.mark.skipif(IS_ROOT, reason="root may write anything")
def test_a_read_only_file_is_not_replaced(store: SemanticMapStore, path: Path) -> None:
    store.write(place("dock"))
    path.chmod(0o400)

    with pytest.raises(SemanticMapError, match="read-only"):
        store.write(place("hall"))


@pytest.mark.skipif(IS_ROOT, reason="root may write anything")
def test_a_folder_that_may_not_be_written_to_is_an_error(
    store: SemanticMapStore, path: Path
) -> None:
    path.parent.chmod(0o500)

    with pytest.raises(SemanticMapError, match="Permission denied"):
        store.write(place("dock"))


# --- the file itself -------------------------------------------------------------------------


def test_permissions_are_kept(store: SemanticMapStore, path: Path) -> None:
    store.write(place("dock"))
    path.chmod(0o640)

    store.write(place("hall"))

    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_symbolic_link_is_followed(tmp_path: Path) -> None:
    link, target = tmp_path / "link.yaml", tmp_path / "real" / "places.yaml"
    link.symlink_to(target)

    SemanticMapStore(link).write(place("dock"))
    SemanticMapStore(target).write(place("hall"))

    assert link.is_symlink()
    assert names(SemanticMapStore(link)) == ["dock", "hall"]


def test_a_file_that_changed_since_it_was_read_is_not_replaced(path: Path) -> None:
    path.write_text("first")
    file = DurableFile(path, lock_timeout_s=1.0)
    _, expected = file.read()
    path.write_text("an editor's work")

    with file.locked():
        assert file.replace(b"ours", expected=expected) is None
        assert path.read_text() == "an editor's work"
        assert file.replace(b"ours", expected=file.fingerprint()) == file.fingerprint()
    assert path.read_text() == "ours"


@contextmanager
def held(lock_path: Path) -> Iterator[None]:
    """Holds a lock in another thread, as another program would."""
    is_held, may_end = threading.Event(), threading.Event()

    def hold() -> None:
        with FileLock(lock_path):
            is_held.set()
            may_end.wait(10.0)

    thread = threading.Thread(target=hold)
    thread.start()
    assert is_held.wait(10.0)
    yield
    may_end.set()
    thread.join()


def test_a_lock_held_too_long_is_an_error_that_names_it(path: Path) -> None:
    store = SemanticMapStore(path, lock_timeout_s=0.0)

    with held(path.parent / ".places.yaml.lock"):
        with pytest.raises(SemanticMapError, match=r"has held .*\.places\.yaml\.lock for 0 s"):
            store.write(place("dock"))
        assert store.read().waypoints == ()

    store.write(place("dock"))
    assert names(store) == ["dock"]


def test_a_write_leaves_every_other_waypoint_as_it_stands(
    store: SemanticMapStore, path: Path
) -> None:
    rows = "".join(
        f"  - {{name: row {i}, pose: {{x: {i}, y: 0, yaw_deg: 0}}}}  # {i}\n" for i in range(100)
    )
    path.write_text(f"map: b1\nwaypoints:\n{rows}")

    tap = Landmark(label="tap")
    store.write(Waypoint(name="row 50", pose=Pose(50.0, 0.0), functional_landmarks=(tap,)))

    changed = path.read_text().splitlines()
    before = f"map: b1\nwaypoints:\n{rows}".splitlines()
    assert [new for old, new in zip(before, changed, strict=True) if old != new] == [
        "  - {name: row 50, pose: {x: 50, y: 0, yaw_deg: 0}, functional_landmarks: [tap]}  # 50"
    ]


class Witness:
    """A lock that remembers what a file held whenever it was taken, and whenever it was left."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.taken: list[bytes] = []
        self.left: list[bytes] = []

    def __enter__(self) -> None:
        self.taken.append(self._content)

    def __exit__(self, *_: object) -> None:
        self.left.append(self._content)

    @property
    def _content(self) -> bytes:
        return self._path.read_bytes() if self._path.exists() else b""


def test_what_a_store_writes_no_other_thread_of_it_reads_again(path: Path) -> None:
    looking = Witness(path)
    store = SemanticMapStore(path, looking=looking)

    for x in (1.0, 2.0):
        store.write(place("dock", x))
    store.read()

    # It changes only while the others wait.
    assert looking.taken[1:] == looking.left[:-1]
    assert len(set(looking.left)) == 3


def test_threads_that_read_at_once_read_the_file_once(path: Path) -> None:
    SemanticMapStore(path).write(place("dock"))
    store = SemanticMapStore(path, looking=threading.Lock())
    found = list[SemanticMap]()
    threads = [threading.Thread(target=lambda: found.append(store.read())) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({id(each.waypoints[0]) for each in found}) == 1
