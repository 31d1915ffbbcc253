"""How this mapspeak was installed: what to type to run it, and to add an extra to it."""

import importlib.util
import os
import re
import shlex
import shutil
import sys
from pathlib import Path


def shell_command(words: str) -> str:
    """Return what a person types here for a command, such as "memory list".

    In a checkout that is its script `run`; where mapspeak is on the PATH, `mapspeak`.
    """
    script = Path(sys.prefix).parent / "run"
    if script.is_file() and (script.parent / "src" / "mapspeak").is_dir():
        is_here = Path("run").exists() and Path("run").samefile(script)
        return f"{'./run' if is_here else shlex.quote(str(script))} {words}"
    own = Path(sys.executable).with_name("mapspeak")
    found = shutil.which("mapspeak")
    if own.exists() and (found is None or Path(found).resolve() != own.resolve()):
        return f"{shlex.quote(str(own))} {words}"
    return f"mapspeak {words}"


def say_install(extra: str, *others: str) -> str:
    """Return the command that installs an extra's packages where this Python finds them.

    Args:
        extra: Such as "dds".
        others: Packages that are needed besides.
    """
    from importlib.metadata import requires  # noqa: PLC0415 - slow, and for a mistake only

    pattern = re.compile(rf"([^;]+);.*extra == ['\"]{extra}['\"]")
    matches = map(pattern.match, requires("mapspeak") or ())
    listed = [match[1].strip() for match in matches if match is not None]
    python = shlex.quote(sys.executable)
    tool = f"{python} -m pip install"
    if importlib.util.find_spec("pip") is None:
        # An environment that uv has made has no pip.
        tool = f"uv pip install --python {python}"
    return f"{tool} {' '.join(map(shlex.quote, (*listed, *others)))}"


def prefer_own_packages(python_path: str) -> None:
    """Let packages of this environment win over those of PYTHONPATH.

    A sourced ROS names folders there with numpy, OpenCV and cbor2 of the system. What only they
    have, such as rclpy, is still found.
    """
    foreign = {str(Path(folder).absolute()) for folder in python_path.split(os.pathsep) if folder}
    sys.path.sort(key=lambda folder: str(Path(folder).absolute()) in foreign)
