"""The pinned packages: complete, hashed, silent about where they come from, and small enough."""

import itertools
import re
import tomllib
from pathlib import Path

import pytest
from packaging.markers import Marker

from benchmarks.footprint import find_sizes_mb

CHECKOUT = Path(__file__).parents[2]
PINS = ("build", "dev", "eval", "runtime")
PIN = re.compile(
    r"^([\w.-]+)==(\S+)(?: ; (.+?))? \\\n((?:    --hash=sha256:\w{64}(?: \\)?\n)+)", re.MULTILINE
)
CPYTHON = {"implementation_name": "cpython", "platform_python_implementation": "CPython"}
PLATFORMS = [
    CPYTHON | {"sys_platform": system, "platform_machine": processor}
    for system, processor in (
        ("linux", "x86_64"),
        ("linux", "aarch64"),
        ("darwin", "x86_64"),
        ("darwin", "arm64"),
        ("win32", "AMD64"),
    )
]
PYTHON_MINORS = (11, 12, 13, 14)
LARGEST_FOOTPRINT_MB = 300


def read_pins(name: str) -> str:
    return (CHECKOUT / "constraints" / f"{name}.txt").read_text()


def versions_in(name: str) -> set[tuple[str, str, str]]:
    return {
        (package, version, marker) for package, version, marker, _ in PIN.findall(read_pins(name))
    }


def installed(name: str, machine: dict[str, str]) -> set[tuple[str, str]]:
    return {
        (package, version)
        for package, version, marker in versions_in(name)
        if not marker or Marker(marker).evaluate(machine)
    }


def names_of(requirements: list[str]) -> set[str]:
    return {re.split(r"[<>=!~;\[ ]", line)[0].replace(".", "-").lower() for line in requirements}


@pytest.mark.parametrize("name", PINS)
def test_every_line_is_a_pin_with_hashes_or_a_comment(name: str) -> None:
    rest = PIN.sub("", read_pins(name)).splitlines()
    assert [line for line in rest if line and not line.lstrip().startswith("#")] == []


@pytest.mark.parametrize("name", PINS)
def test_pins_do_not_say_where_to_get_packages(name: str) -> None:
    assert not re.search(r"://|--(?:index|extra-index|find-links|trusted)|file:", read_pins(name))


def test_every_dependency_is_pinned() -> None:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())
    groups = project["dependency-groups"]
    wanted = {
        "runtime": project["project"]["dependencies"],
        "build": groups["build"] + project["build-system"]["requires"],
        "dev": [line for line in groups["dev"] if isinstance(line, str)],
    }
    for name, requirements in wanted.items():
        assert names_of(requirements) <= {pin[0] for pin in versions_in(name)}


def test_the_tests_run_with_the_versions_that_users_get() -> None:
    for platform, minor in itertools.product(PLATFORMS, PYTHON_MINORS):
        machine = platform | {"python_version": f"3.{minor}", "python_full_version": f"3.{minor}.1"}
        users = installed("runtime", machine) | installed("build", machine)
        assert users <= installed("dev", machine), machine


def test_what_a_user_installs_stays_small() -> None:
    assert sum(find_sizes_mb().values()) <= LARGEST_FOOTPRINT_MB
