"""policy.yaml and its keep-out masks, read into a `Policy`; a mistake is named with its line."""

import math
from collections.abc import Iterator, Sequence
from datetime import time
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PlainValidator, ValidationInfo, model_validator

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.safety.commands import CommandKind
from mapspeak.safety.policy import (
    DAYS,
    RATE_KEYS,
    USUAL_DENIALS,
    USUAL_RATES,
    USUAL_TYPES,
    Approval,
    AreaRule,
    Hours,
    Otherwise,
    Patterns,
    Policy,
    Speeds,
    WhenBusy,
)
from mapspeak.settings import read_settings
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map
from mapspeak.worldmodel.keepout import Outline

CLOSED = 100
"""Nav2 makes a cell lethal at this value alone; less makes it dear, as for preferred lanes."""
MOST_SIDES = 100_000
FINE = 2


def load_mask(path: Path) -> tuple[Outline, ...]:
    """Read a mask and return outlines in the map frame: of what it closes, and of holes in it.

    Raises:
        MapError: A file is missing or damaged, or the mask closes nothing, or is too ragged.
    """
    grid = load_map(path).grid
    outlines = tuple(_find_outlines(grid))
    n_sides = sum(map(len, outlines))
    if n_sides == 0:
        raise MapError(
            f"The mask {path.name} closes nothing: no pixel of it is occupied.",
            hint="Black is closed, unless the .yaml says `negate: 1`.",
        )
    if n_sides > MOST_SIDES:
        raise MapError(
            f"The borders in the mask {path.name} have {n_sides:,} sides, the limit is "
            f"{MOST_SIDES:,}.",
            hint="Paint plain areas, or make it with a coarser resolution.",
        )
    return outlines


def _find_outlines(grid: OccupancyGrid) -> Iterator[Outline]:
    """Return outlines a quarter of a cell outside the borders of the closed cells.

    OpenCV's contours run through the centres of border cells: in cells half as large, grown by one.
    """
    rows, cols = np.nonzero(grid.cells == CLOSED)
    if not rows.size:
        return
    window = slice(rows.min(), rows.max() + 1), slice(cols.min(), cols.max() + 1)
    is_closed = (grid.cells[window] == CLOSED).astype(np.uint8)
    fine = np.pad(is_closed.repeat(FINE, axis=0).repeat(FINE, axis=1), 1)
    fine = cv2.dilate(fine, np.ones((3, 3), dtype=np.uint8)).astype(np.uint8, copy=False)
    fine_m = grid.resolution_m / FINE
    corner = Pose(
        window[1].start * grid.resolution_m - fine_m, window[0].start * grid.resolution_m - fine_m
    )
    frame = OccupancyGrid(
        cells=fine.astype(np.int8), resolution_m=fine_m, origin=grid.origin @ corner
    )
    contours, _ = cv2.findContours(fine, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    # The largest first: it gives the area its place in words.
    for contour in sorted(contours, key=cv2.contourArea, reverse=True):
        fine_cols, fine_rows = contour[:, 0, 0].astype(np.intp), contour[:, 0, 1].astype(np.intp)
        yield tuple(Point(x, y) for x, y in frame.points_at(fine_rows, fine_cols).tolist())


THINNEST_M = 0.001
N_OTHER_WAYS = 2
"""An area is said in one of three ways, and not in the others."""

_Name = Annotated[str, Field(min_length=1, max_length=80)]
_Reason = Annotated[str, Field(max_length=200)]
_Pattern = Annotated[str, Field(min_length=1, max_length=200)]
_Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
_Corner = Annotated[list[_Coordinate], Field(min_length=2, max_length=2)]
_Outline = Annotated[list[_Corner], Field(min_length=3)]
_Region = Annotated[str, Field(pattern=r"^[A-Z]\d+$")]
_TimeOfDay = Annotated[str, Field(pattern=r"^(?:[01]\d|2[0-3]):[0-5]\d$|^24:00$")]
_Day = Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"]
_PerMinute = Annotated[int, Field(ge=0)]


def _read_mask(written: Any, info: ValidationInfo) -> tuple[Outline, ...]:  # noqa: ANN401 - YAML
    """Read the mask that is named, from beside the policy's file."""
    if not isinstance(written, str) or not written:
        message = "the name of a map's .yaml is wanted"
        raise ValueError(message)
    folder: Path = (info.context or {}).get("folder", Path())
    try:
        return load_mask(folder / written)
    except MapError as error:
        raise ValueError(str(error).rstrip(".")) from error


_Mask = Annotated[tuple[Outline, ...], PlainValidator(_read_mask)]


class _Written(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class _WrittenSpeeds(_Written):
    linear_mps: Annotated[float, Field(ge=0, le=20)] = Speeds().linear_mps
    angular_radps: Annotated[float, Field(ge=0, le=20)] = Speeds().angular_radps


class _WrittenGoals(_Written):
    known_way: bool = True
    clearance_m: Annotated[float, Field(ge=0, le=5)] = Policy().clearance_m
    farthest_m: Annotated[float, Field(gt=0)] = Policy().farthest_m


class _WrittenArea(_Written):
    name: _Name
    outline: _Outline | None = None
    region: _Region | None = None
    mask: _Mask | None = None
    reason: _Reason = ""

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if [self.outline, self.region, self.mask].count(None) != N_OTHER_WAYS:
            message = f"{self.name!r} needs one of: outline, region, mask"
            raise ValueError(message)
        return self

    @model_validator(mode="after")
    def _closes_something(self) -> Self:
        corners = self.outline or ()
        if corners and _is_a_line(corners):
            message = f"{self.name!r} closes nothing: its corners lie on one line"
            raise ValueError(message)
        return self

    def rule(self, hours: Hours | None = None) -> AreaRule:
        corners = tuple(Point(x, y) for x, y in self.outline or ())
        outline, *further = self.mask or (corners,)
        return AreaRule(
            name=self.name,
            outline=outline,
            further_outlines=tuple(further),
            region_id=self.region or "",
            hours=hours,
            reason=" ".join(self.reason.split()),
        )


class _WrittenClosure(_WrittenArea):
    begins: Annotated[_TimeOfDay, Field(alias="from")] = "00:00"
    ends: Annotated[_TimeOfDay, Field(alias="until")] = "24:00"
    days: Annotated[list[_Day], Field(min_length=1)] = [*get_args(_Day)]

    def hours(self) -> Hours:
        days = frozenset(DAYS.index(day) for day in self.days)
        return Hours(begins=_read_time(self.begins), ends=_read_time(self.ends), days=days)


class _WrittenPatterns(_Written):
    allow: list[_Pattern] = ["*"]
    deny: list[_Pattern] = []
    usual_denials: bool = True

    def patterns(self, kind: CommandKind) -> Patterns:
        return Patterns(
            allow=tuple(self.allow),
            deny=tuple(self.deny),
            usual=USUAL_DENIALS[kind] if self.usual_denials else (),
            usual_types=USUAL_TYPES[kind] if self.usual_denials else (),
        )


class _WrittenApproval(_Written):
    drives: bool = False
    publishes: bool = False
    calls: bool = False
    actions: bool = False
    parameters: bool = False
    skills: bool = False
    otherwise: Literal["refuse", "queue"] = "refuse"

    def approval(self) -> Approval:
        keys = {kind: key.removesuffix("_per_minute") for kind, key in RATE_KEYS.items()}
        kinds = frozenset(kind for kind, key in keys.items() if getattr(self, key))
        return Approval(kinds=kinds, otherwise=Otherwise(self.otherwise))


class _WrittenRates(_Written):
    drives_per_minute: _PerMinute = USUAL_RATES[CommandKind.DRIVE]
    publishes_per_minute: _PerMinute = USUAL_RATES[CommandKind.PUBLISH]
    calls_per_minute: _PerMinute = USUAL_RATES[CommandKind.CALL]
    actions_per_minute: _PerMinute = USUAL_RATES[CommandKind.ACT]
    parameters_per_minute: _PerMinute = USUAL_RATES[CommandKind.SET_PARAMETER]
    skills_per_minute: _PerMinute = USUAL_RATES[CommandKind.SKILL]


class _PolicyFile(_Written):
    read_only: bool = False
    latch_on_stop: bool = False
    when_busy: Literal["replace", "wait", "refuse"] = "replace"
    speed: _WrittenSpeeds = _WrittenSpeeds()
    goals: _WrittenGoals = _WrittenGoals()
    keep_out: list[_WrittenArea] = []
    closed: list[_WrittenClosure] = []
    publish: _WrittenPatterns = _WrittenPatterns()
    call: _WrittenPatterns = _WrittenPatterns()
    act: _WrittenPatterns = _WrittenPatterns()
    set_parameter: _WrittenPatterns = _WrittenPatterns()
    skill: _WrittenPatterns = _WrittenPatterns()
    approval: _WrittenApproval = _WrittenApproval()
    rates: _WrittenRates = _WrittenRates()

    def policy(self) -> Policy:
        return Policy(
            is_read_only=self.read_only,
            latches_on_stop=self.latch_on_stop,
            when_busy=WhenBusy(self.when_busy),
            speeds=Speeds(linear_mps=self.speed.linear_mps, angular_radps=self.speed.angular_radps),
            needs_known_way=self.goals.known_way,
            clearance_m=self.goals.clearance_m,
            farthest_m=self.goals.farthest_m,
            areas=(
                *(area.rule() for area in self.keep_out),
                *(area.rule(area.hours()) for area in self.closed),
            ),
            patterns={kind: getattr(self, kind).patterns(kind) for kind in USUAL_DENIALS},
            approval=self.approval.approval(),
            rates={kind: getattr(self.rates, key) for kind, key in RATE_KEYS.items()},
        )


def load_policy(path: Path) -> Policy:
    """Read policy.yaml; what is left away keeps its default.

    Raises:
        ConfigError: The file cannot be read, or has a mistake; says the line and the key. So does
            a mask that it names, which lies beside it unless its path is absolute.
    """
    advice = "docs/howto/limits.md explains every key."
    read = read_settings(
        path, _PolicyFile, name="policy.yaml", advice=advice, context={"folder": path.parent}
    )
    return read.policy()


def _is_a_line(corners: Sequence[Sequence[float]]) -> bool:
    (x0, y0), *others = corners
    off = [(x - x0, y - y0) for x, y in others]
    along = max(off, key=lambda each: math.hypot(*each))
    length_m = math.hypot(*along)
    if length_m == 0.0:
        return True
    return all(abs(x * along[1] - y * along[0]) / length_m < THINNEST_M for x, y in off)


def _read_time(text: str) -> time:
    """Read a time of day; the end of a day is the midnight that follows."""
    hour, minute = (int(part) for part in text.split(":"))
    return time(hour % 24, minute)
