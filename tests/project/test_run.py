"""./run makes the environment once, and again when it must; a fake uv stands for the network."""

import os
import re
import select
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from mapspeak.cli.commands import COMMANDS

CHECKOUT = Path(__file__).parents[2]
SYSTEM_TOOLS = "cat chmod cksum dirname ls mkdir rm rmdir sed sh"

# Keeps a log of its calls; its environment's Python repeats what it is told.
FAKE_UV = """#!/bin/sh
echo "$*" >>"$UV_LOG"
case $1 in
venv)
    for target; do :; done
    mkdir -p "$target/bin"
    printf '#!/bin/sh\\necho python "$@"\\n' >"$target/bin/python"
    chmod +x "$target/bin/python"
    ;;
pip)
    echo "uv speaks on stdout"
    [ ! -p "$UV_LOG.gate" ] || cat "$UV_LOG.gate"
    [ ! -e "$UV_LOG.kill" ] || kill -KILL 0
    ;;
esac
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """A copy of what ./run needs, and a PATH with nothing but the system's tools and a fake uv."""

    checkout: Path
    tools: Path
    uv_log: Path

    def start(
        self, *command: str, checkout: Path | None = None, stdin: int | None = None
    ) -> subprocess.Popen[str]:
        return subprocess.Popen(  # noqa: S603 - our own script
            [(checkout or self.checkout) / "run", *command],
            cwd=self.tools,
            env={"PATH": str(self.tools), "UV_LOG": str(self.uv_log)},
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(self, *command: str, checkout: Path | None = None) -> tuple[int, str, str]:
        process = self.start(*command, checkout=checkout)
        stdout, stderr = process.communicate(timeout=30)
        return process.returncode, stdout, stderr

    def calls_of_uv(self) -> list[str]:
        calls = self.uv_log.read_text().splitlines() if self.uv_log.exists() else []
        self.uv_log.unlink(missing_ok=True)
        return [call.split()[0] for call in calls]


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    checkout, tools = tmp_path / "a checkout", tmp_path / "bin"
    for folder in (checkout, tools):
        folder.mkdir()
    for name in ("run", "pyproject.toml"):
        shutil.copy(CHECKOUT / name, checkout)
    shutil.copytree(CHECKOUT / "constraints", checkout / "constraints")
    for name in SYSTEM_TOOLS.split():
        (tools / name).symlink_to(shutil.which(name) or pytest.fail(f"no {name} here"))
    (tools / "sleep").symlink_to(shutil.which("true") or pytest.fail("no true here"))
    (tools / "uv").write_text(FAKE_UV)
    (tools / "uv").chmod(0o755)
    return Desk(checkout=checkout, tools=tools, uv_log=tmp_path / "uv.log")


MADE = ["venv", "pip", "pip"]
FILLED = ["pip", "pip"]


def test_the_first_call_makes_the_environment_and_stdout_is_the_commands_alone(desk: Desk) -> None:
    assert desk.run("python", "-V", "two words")[:2] == (0, "python -V two words\n")
    assert desk.calls_of_uv() == MADE


def test_the_second_call_installs_nothing(desk: Desk) -> None:
    desk.run("python")
    desk.calls_of_uv()
    assert desk.run("python", "again") == (0, "python again\n", "")
    assert desk.calls_of_uv() == []


def test_other_pins_are_installed_into_the_environment_that_is_there(desk: Desk) -> None:
    desk.run("python")
    desk.calls_of_uv()
    with (desk.checkout / "constraints" / "runtime.txt").open("a") as pins:
        pins.write("another==1.0\n")
    assert desk.run("python")[0] == 0
    assert desk.calls_of_uv() == FILLED


def test_the_tests_need_more_packages_than_the_product(desk: Desk) -> None:
    desk.run("python")
    desk.calls_of_uv()
    assert desk.run("test", "one.py")[:2] == (0, "python -m pytest one.py\n")
    assert desk.calls_of_uv() == FILLED
    assert desk.run("python")[0] == 0
    assert desk.calls_of_uv() == []


def test_what_a_start_loads_is_compiled_when_the_environment_is_made(tmp_path: Path) -> None:
    script = (CHECKOUT / "run").read_text()
    function = re.search(r"^write_byte_code\(\) \{.*?^\}", script, re.MULTILINE | re.DOTALL)
    assert function is not None
    subprocess.run(  # noqa: S603 - our own script
        ["/bin/sh", "-euc", f"{function[0]}\nwrite_byte_code"],
        env={
            "PATH": os.environ["PATH"],
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTHONPYCACHEPREFIX": str(tmp_path / "compiled"),
            "python": sys.executable,
            "venv": str(tmp_path),
        },
        check=True,
    )
    compiled = {file.name.partition(".")[0] for file in tmp_path.rglob("*.pyc")}
    assert compiled >= {"transport", "book", "simulation", "func_metadata", "console"}
    assert [file.name for file in tmp_path.iterdir()] == ["compiled"]


def test_an_interrupted_installation_is_done_again_from_the_start(desk: Desk) -> None:
    kill = Path(f"{desk.uv_log}.kill")
    kill.touch()
    assert desk.run("python")[:2] == (-signal.SIGKILL, "")
    kill.unlink()
    desk.calls_of_uv()
    assert desk.run("python")[0] == 0
    assert desk.calls_of_uv() == MADE


def test_a_checkout_that_moved_gets_a_new_environment(desk: Desk, tmp_path: Path) -> None:
    desk.run("python")
    desk.calls_of_uv()
    moved = desk.checkout.rename(tmp_path / "elsewhere")
    assert desk.run("python", checkout=moved)[0] == 0
    assert desk.calls_of_uv() == MADE


def test_without_python_and_uv_it_says_what_to_install(desk: Desk) -> None:
    (desk.tools / "uv").unlink()
    code, stdout, stderr = desk.run("demo")
    assert (code, stdout) == (1, "")
    for system in ("apt install python3", "dnf install", "brew install", "wsl --install"):
        assert system in stderr


def test_two_calls_at_once_make_one_environment(desk: Desk) -> None:
    both = [desk.start("python", name) for name in ("one", "two")]
    assert [process.communicate(timeout=30)[0] for process in both] == [
        "python one\n",
        "python two\n",
    ]
    assert desk.calls_of_uv() == MADE


SLOW_MKDIR = """#!/bin/sh
{mkdir} "$@" || exit
case $* in *.venv.lock) [ ! -p "$UV_LOG.gate" ] || cat "$UV_LOG.gate" ;; esac
"""


def test_a_call_whose_lock_another_one_took_waits_for_that_one(desk: Desk) -> None:
    (desk.tools / "mkdir").unlink()
    (desk.tools / "mkdir").write_text(SLOW_MKDIR.format(mkdir=shutil.which("mkdir")))
    (desk.tools / "mkdir").chmod(0o755)
    gate, others = Path(f"{desk.uv_log}.gate"), desk.checkout / ".venv.lock" / str(os.getpid())
    os.mkfifo(gate)
    call = desk.start("python", "mine")
    with gate.open("w"):
        others.mkdir()
        gate.unlink()
    assert call.stderr is not None
    assert f"Waiting for ./run ({os.getpid()})" in call.stderr.readline()
    assert desk.calls_of_uv() == []
    others.rmdir()
    assert call.communicate(timeout=30)[0] == "python mine\n"
    assert desk.calls_of_uv() == MADE


def test_a_lock_that_a_killed_call_left_behind_is_freed(desk: Desk) -> None:
    ended = subprocess.Popen(["true"])  # noqa: S607 - any process that has ended
    ended.wait()
    (desk.checkout / ".venv.lock" / str(ended.pid)).mkdir(parents=True)
    assert desk.run("python")[0] == 0
    assert not (desk.checkout / ".venv.lock").exists()


def test_a_client_that_kills_a_call_too_soon_finds_the_environment_next_time(desk: Desk) -> None:
    (desk.tools / "setsid").symlink_to(shutil.which("setsid") or pytest.fail("no setsid here"))
    gate = Path(f"{desk.uv_log}.gate")
    os.mkfifo(gate)
    call = desk.start("python", "first")
    with gate.open("w"):
        os.killpg(call.pid, signal.SIGKILL)
        gate.unlink()
    call.communicate(timeout=30)
    assert call.returncode == -signal.SIGKILL
    assert not (desk.checkout / ".venv.lock").exists()
    assert desk.calls_of_uv() == MADE
    assert desk.run("python", "second") == (0, "python second\n", "")
    assert desk.calls_of_uv() == []


def test_a_call_that_is_ended_in_a_terminal_ends_the_installation_too(desk: Desk) -> None:
    (desk.tools / "setsid").symlink_to(shutil.which("setsid") or pytest.fail("no setsid here"))
    gate = Path(f"{desk.uv_log}.gate")
    os.mkfifo(gate)
    main, terminal = os.openpty()
    call = desk.start("python", "first", stdin=terminal)
    with gate.open("w") as held:
        # Where the tests run in the background, Ctrl-C is ignored; both signals end in one trap.
        os.killpg(call.pid, signal.SIGTERM)
        assert call.wait(timeout=30) == 130
        readers = select.poll()
        readers.register(held, 0)
        assert readers.poll(30_000), "nobody installs any more"
    gate.unlink()
    call.communicate()
    for end in (main, terminal):
        os.close(end)
    assert desk.run("python", "second")[0] == 0


def test_what_could_not_be_installed_ends_the_call(desk: Desk) -> None:
    (desk.tools / "setsid").symlink_to(shutil.which("setsid") or pytest.fail("no setsid here"))
    (desk.tools / "uv").unlink()
    assert desk.run("python")[0] == 1


@pytest.mark.parametrize("word", ["help", "--help", "-h"])
def test_help_is_of_the_product_first_and_needs_no_environment(desk: Desk, word: str) -> None:
    code, stdout, _ = desk.run(word)
    assert code == 0
    products, developers = stdout.split("For those who change mapspeak:")
    told = dict(re.findall(r"^  \./run (\w+) +(.+)$", products, re.MULTILINE))
    assert told == {name: what for name, (_, what) in COMMANDS.items()}
    assert "./run check" in developers
    assert not (desk.checkout / ".venv").exists()


def test_the_script_is_executable_for_everyone() -> None:
    assert (CHECKOUT / "run").stat().st_mode & 0o111 == 0o111
