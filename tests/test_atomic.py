"""Files that are replaced as a whole, whatever happens meanwhile."""

import errno
import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mapspeak.atomic import replace_file, replacing

CRASH = """
import os, sys
from pathlib import Path
from mapspeak.atomic import replacing
with replacing(Path(sys.argv[1]), ending=sys.argv[2]) as file:
    file.write(b"half")
    file.flush()
    os._exit(9)
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file that is there already."""
    old = tmp_path / "kept.yaml"
    old.write_bytes(b"old")
    return old


def test_a_new_content_takes_the_place_of_the_old_one_with_its_permissions(path: Path) -> None:
    path.chmod(0o640)
    replace_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert path.stat().st_mode & 0o777 == 0o640
    assert list(path.parent.iterdir()) == [path]


def test_a_full_disk_leaves_the_old_file_and_nothing_else(path: Path) -> None:
    def write_half() -> None:
        with replacing(path) as file:
            file.write(b"half")
            file.flush()
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        write_half()
    assert path.read_bytes() == b"old"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("ending", ["", "tmp"])
def test_a_crash_leaves_the_old_file_and_hinders_no_later_write(path: Path, ending: str) -> None:
    crashed = subprocess.run([sys.executable, "-c", CRASH, path, ending], check=False)  # noqa: S603 - our own program
    assert crashed.returncode == 9
    assert path.read_bytes() == b"old"
    with replacing(path, ending=ending) as file:
        file.write(b"new")
    assert path.read_bytes() == b"new"
    assert list(path.parent.iterdir()) == [path]


def test_what_another_is_writing_stays_beside_what_one_has_left_that_was_killed(path: Path) -> None:
    subprocess.run([sys.executable, "-c", CRASH, path, ""], check=False)  # noqa: S603 - our own program
    [left] = (each for each in path.parent.iterdir() if each != path)
    written = path.with_name(f".{path.name}.1")
    with written.open("xb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        replace_file(path, b"new")
        assert written.exists()
    assert not left.exists()


def test_a_new_file_that_is_closed_is_given_up(path: Path) -> None:
    with replacing(path) as file:
        file.write(b"new")
        file.close()
    assert path.read_bytes() == b"old"
    assert list(path.parent.iterdir()) == [path]


def test_a_link_is_followed_and_a_missing_folder_made(tmp_path: Path) -> None:
    target, link = tmp_path / "far" / "kept", tmp_path / "link"
    link.symlink_to(target)
    replace_file(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"
    assert os.listdir(target.parent) == ["kept"]  # noqa: PTH208 - names are compared
