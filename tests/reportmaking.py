"""Folders of runs made by hand for tests of the report, and a reader of its pages."""

import io
import json
import re
from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from PIL import Image

from drawing import grid_from_text
from mapspeak.evaluation.trials import (
    Failure,
    Score,
    ToolCall,
    Trial,
    TrialResult,
    TrialState,
    Turn,
    trial_folder,
    turn_line,
    write_result,
)
from mapspeak.geometry import Pose
from mapspeak.spatial.mapwriting import write_map

DOCUMENT = re.compile(r'<script type="application/json" id="document">(.*?)</script>', re.DOTALL)

ROOM = """
    ########
    #......#
    #......#
    ########
"""


def make_trial(number: int = 1, **changes: object) -> Trial:
    """Gives a trial of the paper's Task 2 by the script, but for what is changed."""
    plain = Trial(
        task="smallest-room",
        world="flat",
        seed=number - 1,
        agent="scripted",
        representation="picture-table",
        number=number,
    )
    return replace(plain, **changes)  # type: ignore[arg-type]  # fields of a trial


def make_result(trial: Trial, *, failure: Failure | None = None, **changes: object) -> TrialResult:
    """Gives a result: a success, unless a mistake is named."""
    score = Score(is_success=failure is None, failure=failure, reason="It stands in the toilet.")
    plain = TrialResult(
        trial=trial,
        prompt="Go to the smallest room.",
        answer="I am there.",
        state=TrialState.FINISHED,
        score=score,
        driven_m=4.0,
        shortest_m=2.0,
        n_turns=3,
        n_calls=2,
        n_decisions=2,
        robot_s=8.0,
        wall_s=1.5,
    )
    return replace(plain, **changes)  # type: ignore[arg-type]  # fields of a result


def write_course(run: Path, trial: Trial, *turns: Turn) -> Path:
    """Writes a way of four metres through a room and what was said on it."""
    folder = trial_folder(run, trial)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "turns.jsonl").write_bytes(b"".join(map(turn_line, turns)))
    states = [
        {"time_s": 2.0 * at, "x": 1.0 + at, "y": 1.5, "yaw_rad": 0.0}
        | {"slam_error_m": 0.0, "driven_m": float(at), "n_collisions": 0}
        for at in range(5)
    ]
    lines = "".join(f"{json.dumps(state)}\n" for state in states)
    (folder / "state.jsonl").write_text(lines)
    write_map(grid_from_text(ROOM, resolution_m=1.0), folder / "map.yaml")
    return folder


def write_trial(run: Path, trial: Trial, **changes: object) -> Path:
    """Writes a trial that is done: a look, a drive, and one picture."""
    folder = write_course(run, trial, *make_turns())
    write_picture(folder, "003.png", shade=40)
    write_result(run, make_result(trial, **changes))  # type: ignore[arg-type]  # likewise
    return folder


def make_turns(*, said: str = "Explored: 6.0 m2 of free floor.") -> tuple[Turn, ...]:
    """Gives a conversation of five turns, four steps."""
    look = ToolCall(tool="look_at_map", arguments={"layers": ["rooms"]})
    start, end = Pose(1.0, 1.5), Pose(5.0, 1.5)
    return (
        Turn(role="user", text="Go to the smallest room.", robot_s=0.0, pose=start),
        Turn(role="agent", call=look, robot_s=0.0, pose=start),
        Turn(
            role="tool",
            text=said,
            call=ToolCall(tool="look_at_map", arguments={}),
            pictures=("003.png",),
            robot_s=4.0,
            pose=start,
        ),
        Turn(role="agent", text="I go there.", n_input_tokens=900, robot_s=4.0, pose=start),
        Turn(role="agent", text="I am there.", robot_s=8.0, pose=end),
    )


def write_picture(folder: Path, name: str, *, shade: int, size: tuple[int, int] = (6, 4)) -> None:
    """Writes a grey picture."""
    file = io.BytesIO()
    Image.new("L", size, shade).save(file, "PNG")
    (folder / "pictures").mkdir(exist_ok=True)
    (folder / "pictures" / name).write_bytes(file.getvalue())


def read_replay(page: Path) -> Any:  # noqa: ANN401 - JSON
    """Gives the document that a replay shows."""
    (told,) = DOCUMENT.findall(page.read_text(encoding="utf-8"))
    return json.loads(told)


@dataclass
class Element:
    """An element of a page, with the text in it."""

    tag: str
    attributes: dict[str, str | None]
    text: str = ""


class ReadPage(HTMLParser):
    """A page as a browser without scripts reads it.

    Attributes:
        elements: All in their order.
    """

    def __init__(self) -> None:
        super().__init__()
        self.elements: list[Element] = []
        self._open: list[Element] = []

    @classmethod
    def of(cls, path: Path) -> "ReadPage":
        """Reads a file."""
        page = cls()
        page.feed(path.read_text(encoding="utf-8"))
        page.close()
        return page

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        new = Element(tag, dict(attrs))
        self.elements.append(new)
        if tag not in {"meta", "img", "input", "br", "link"}:
            self._open.append(new)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop().tag == tag

    def handle_data(self, data: str) -> None:
        for each in self._open:
            each.text += data

    @property
    def is_whole(self) -> bool:
        """True when every element was closed."""
        return not self._open

    @property
    def text(self) -> str:
        """Everything there is to read."""
        return next(each for each in self.elements if each.tag == "body").text

    def all(self, tag: str, kind: str | None = None) -> list[Element]:
        """Gives all elements of a tag, and of a class if one is named."""
        return [
            each
            for each in self.elements
            if each.tag == tag
            and (kind is None or kind in (each.attributes.get("class") or "").split())
        ]

    def values(self, *names: str) -> list[str]:
        """Gives the values of some attributes wherever they stand."""
        found = (each.attributes.get(name) for each in self.elements for name in names)
        return [value for value in found if value is not None]
