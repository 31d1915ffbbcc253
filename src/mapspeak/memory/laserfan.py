"""Laser ranges at the pose that a landmark was seen from: all around, and as the file keeps them.

A bearing read off a picture is good to ten degrees, so the range along it alone says little. The
file therefore keeps a fan of beams around it, from the same pose.
"""

import math
import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose, wrap_angle

STEP_RAD = math.radians(3.0)
"""Between two beams: 0.2 m at four metres, the side of the cells in which a thing is looked for.

Twice as many say no more, in the buildings for choosing, and make files longer.
"""
HALF_FAN_RAD = 7 * STEP_RAD
"""Two standard deviations of a direction that a person or a model reads off a picture, or 20
degrees, in whole steps."""
SAME_STAND_M = 0.1
"""A scan is valid up to this distance from its pose; poses are not known better."""
MOST_BEAMS = 360
LEAST_TURN_RAD = math.radians(0.99)
NEAREST_M, FARTHEST_M = 0.1, 1000.0

_N_AROUND = round(math.tau / STEP_RAD)
_NUMBER = r"-?\d+(?:\.\d+)?"
_TEXT = re.compile(rf"from ({_NUMBER}) to ({_NUMBER}) deg at (.+) m")
_RANGE = re.compile(r"-|>?\d+(?:\.\d+)?")
_RANGES = re.compile(rf"(?:{_RANGE.pattern})(?: (?:{_RANGE.pattern}))*")
_UNKNOWN = "-"
_EXAMPLE = "from -4.0 to 4.0 deg at 2.2 2.1 - >20 3.4 m"


@dataclass(frozen=True, slots=True, kw_only=True)
class LaserFan:
    """Ranges of evenly spaced beams from the pose that a landmark was seen from.

    Attributes:
        first_rad: The direction of the first beam from the heading of that pose, left positive.
        last_rad: The direction of the last one, more to the left.
        ranges_m: By beam, from that pose; infinite if it hit nothing, None if unknown.
        reach_m: Range limit of the beams that hit nothing; None if all hit something.

    Raises:
        SemanticMapError: The values are no valid fan.
    """

    first_rad: float
    last_rad: float
    # Directions alone distinguish nearly all fans, and places are hashed by all their content.
    ranges_m: tuple[float | None, ...] = field(hash=False)
    reach_m: float | None = None

    def __post_init__(self) -> None:
        n, turn_rad = len(self.ranges_m), self.last_rad - self.first_rad
        _require(2 <= n <= MOST_BEAMS, f"{n} beams", f"2 to {MOST_BEAMS} of them")
        is_turn = math.isfinite(turn_rad) and LEAST_TURN_RAD <= turn_rad <= math.tau
        _require(is_turn, "its directions", "from right to left, 1 to 360 degrees in all")
        met_m = [each for each in self.ranges_m if each is not None and each != math.inf]
        _require(all(0 <= each <= FARTHEST_M for each in met_m), "a beam", "0 to 1000 m")
        is_open = math.inf in self.ranges_m
        has_reach = self.reach_m is not None and NEAREST_M <= self.reach_m <= FARTHEST_M
        _require(has_reach == is_open, "beams that met nothing", "of one reach, such as >20")
        first_rad = wrap_angle(self.first_rad)
        object.__setattr__(self, "first_rad", first_rad)
        object.__setattr__(self, "last_rad", first_rad + turn_rad)

    @property
    def step_rad(self) -> float:
        """Angle from one beam to the next."""
        return (self.last_rad - self.first_rad) / (len(self.ranges_m) - 1)

    @property
    def text(self) -> str:
        """One line for people: directions in degrees, ranges in metres to the decimetre.

        `-` is unknown, and `>20` hit nothing within 20 m.
        """
        first, last = (math.degrees(each) for each in (self.first_rad, self.last_rad))
        if round(first, 2) == -180.0:
            first, last = first + 360.0, last + 360.0
        said = " ".join(self._say(each) for each in self.ranges_m)
        return f"from {_decimals(first)} to {_decimals(last)} deg at {said} m"

    def find_range_m(self, bearing_rad: float) -> float | None:
        """Return how far the beam nearest to a bearing reached what it hit; None if it hit none."""
        number = round((bearing_rad - self.first_rad) / self.step_rad)
        range_m = self.ranges_m[number] if 0 <= number < len(self.ranges_m) else None
        return None if range_m == math.inf else range_m

    def turned(self, turn_rad: float) -> "LaserFan":
        """Return the same beams from another heading.

        Args:
            turn_rad: From the new heading to the old one, counter-clockwise.
        """
        return LaserFan(
            first_rad=self.first_rad + turn_rad,
            last_rad=self.last_rad + turn_rad,
            ranges_m=self.ranges_m,
            reach_m=self.reach_m,
        )

    @classmethod
    def read(cls, text: str) -> "LaserFan":
        """Parse the format of `text`.

        Raises:
            SemanticMapError: The text is no fan; the message says why.
        """
        match = _TEXT.fullmatch(" ".join(text.split()))
        _require(match, "it", f"like '{_EXAMPLE}'")
        assert match is not None  # noqa: S101 - required above
        tokens = match[3].split(" ")
        if not _RANGES.fullmatch(match[3]):
            number = next(n for n, each in enumerate(tokens, start=1) if not _RANGE.fullmatch(each))
            _require(None, f"beam {number}", "metres, > and metres, or -")
        reaches = {token for token in tokens if token[0] == ">"}
        _require(len(reaches) <= 1, "beams that met nothing", "of one reach, such as >20")
        return cls(
            first_rad=math.radians(float(match[1])),
            last_rad=math.radians(float(match[2])),
            ranges_m=tuple(
                None if token == _UNKNOWN else math.inf if token[0] == ">" else float(token)
                for token in tokens
            ),
            reach_m=next((float(token[1:]) for token in reaches), None),
        )

    def _say(self, range_m: float | None) -> str:
        if range_m is None:
            return _UNKNOWN
        if range_m != math.inf:
            return f"{range_m:.1f}"
        return ">" + f"{self.reach_m:.1f}".removesuffix(".0")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LaserRing:
    """A full turn of the laser, one beam per step; compared by identity.

    Attributes:
        ranges_m: From that pose, shape (120,), counter-clockwise from its heading; infinite if a
            beam hit nothing, NaN if unknown.
        reach_m: Range limit of a beam that hit nothing.
    """

    pose: Pose
    ranges_m: NDArray[np.float64]
    reach_m: float

    def __post_init__(self) -> None:
        ranges_m = np.array(self.ranges_m, dtype=np.float64)
        ranges_m.setflags(write=False)
        object.__setattr__(self, "ranges_m", ranges_m)

    def find_fan(self, stood: Pose, bearing_rad: float) -> LaserFan | None:
        """Return the ranges around a bearing from the heading of a pose, left positive.

        None if the pose is not that of the scan, or nothing is known.
        """
        if self.pose.point.distance_to(stood.point) > SAME_STAND_M:
            return None
        turn_rad = wrap_angle(self.pose.yaw_rad - stood.yaw_rad)
        middle = round((bearing_rad - turn_rad) / STEP_RAD)
        half = round(HALF_FAN_RAD / STEP_RAD)
        numbers = range(middle - half, middle + half + 1)
        met_m = [float(self.ranges_m[number % _N_AROUND]) for number in numbers]
        if all(map(math.isnan, met_m)):
            return None
        return LaserFan(
            first_rad=numbers[0] * STEP_RAD + turn_rad,
            last_rad=numbers[-1] * STEP_RAD + turn_rad,
            ranges_m=tuple(None if math.isnan(each) else each for each in met_m),
            reach_m=self.reach_m if math.inf in met_m else None,
        )


def build_ring(
    pose: Pose,
    *,
    angles_rad: NDArray[np.float64],
    ranges_m: NDArray[np.float64],
    reach_m: float,
) -> LaserRing:
    """Resample a turn of the laser to even steps: each step gets the beam nearest to it.

    Args:
        angles_rad: By beam, from the heading, left positive.
        reach_m: How far a beam that met nothing would have met something.
    """
    steps = np.asarray(angles_rad) / STEP_RAD
    nearest = np.round(steps)
    at, off = nearest.astype(np.intp) % _N_AROUND, np.abs(steps - nearest)
    ring = np.full(_N_AROUND, np.nan)
    order = np.argsort(-off, kind="stable")
    # Of several values for one index the last one stays.
    ring[at[order]] = np.asarray(ranges_m)[order]
    ring[np.isfinite(ring) & (ring > FARTHEST_M)] = np.nan
    if reach_m < NEAREST_M:
        ring[np.isinf(ring)] = np.nan
    return LaserRing(pose=pose, ranges_m=ring, reach_m=min(reach_m, FARTHEST_M))


def _decimals(value: float) -> str:
    """Return hundredths, or tenths where that is the same."""
    # Adding zero turns -0.0 into 0.0.
    return f"{round(value, 2) + 0.0:.2f}".removesuffix("0")


def _require(is_right: object, what: str, expected: str) -> None:
    if not is_right:
        message = f"What a laser met is not clear: {what} should be {expected}."
        raise SemanticMapError(message, hint=f"Write it like '{_EXAMPLE}', or leave it out.")
