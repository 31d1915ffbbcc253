"""Any waypoint at all, for laws that hold for every one of them."""

import math
from datetime import UTC, datetime, timedelta, timezone

from hypothesis import strategies as st

from mapspeak.geometry import Pose
from mapspeak.memory import Confidence, Landmark, LaserFan, Waypoint

# One on each line: what YAML, or a reader of lines, might take for something else.
_TRICKY_TEXTS = """\
101
yes
null
~
- x
a: b
a #b
#a
[a]
{a: b}
'a'
"
|
*a
&a
!a
%a
@a
`a
a:
: a
?
1.5
2026-11-02
---
...
<<
a, b
a]b
a}b
=
0x1
\\n
소화기
消火器
é
🧯
a\u200db
\ufeffa
a\u2028b
a\x85b"""
_TRICKY = st.sampled_from(_TRICKY_TEXTS.split("\n"))
_SIMPLE = st.text(st.characters(codec="utf-8"), min_size=1, max_size=12)
_WORDS = st.one_of(_TRICKY, _SIMPLE, st.lists(_TRICKY, min_size=2, max_size=4).map(" ".join))
_LINES = _WORDS.filter(lambda text: any(c.isprintable() and c != " " for c in text))
_TEXTS = st.lists(st.one_of(_WORDS, st.just("")), max_size=3).map("\n".join)
_NUMBERS = st.floats(-1e6, 1e6) | st.sampled_from([-0.0, -0.0004, 1e-9, 12.3456])
_ANGLES = st.floats(-7.0, 7.0)
_POSES = st.builds(Pose, _NUMBERS, _NUMBERS, _ANGLES)
_ZONES = st.sampled_from([UTC, timezone(timedelta(hours=9)), timezone(-timedelta(hours=3.5))])
_TIMES = st.datetimes(datetime(2, 1, 1), datetime(9998, 12, 31), timezones=_ZONES)  # noqa: DTZ001 - the bounds take no zone


def laser_fans() -> st.SearchStrategy[LaserFan]:
    """Gives any of what a laser may have met."""
    beams = st.none() | st.just(math.inf) | st.floats(0, 1000)
    return st.builds(
        _fan,
        _ANGLES,
        st.floats(0.02, 6.2),
        st.lists(beams, min_size=2, max_size=30),
        st.floats(0.1, 1000),
    )


def _fan(first_rad: float, turn_rad: float, beams: list[float | None], reach_m: float) -> LaserFan:
    return LaserFan(
        first_rad=first_rad,
        last_rad=first_rad + turn_rad,
        ranges_m=tuple(beams),
        reach_m=reach_m if math.inf in beams else None,
    )


def landmarks(*, has_pose: bool = False) -> st.SearchStrategy[Landmark]:
    """Gives any landmark, most of them with a label alone; perhaps with a pose of its own."""
    full = st.builds(
        Landmark,
        label=_LINES,
        purpose=st.none() | _WORDS,
        bearing_rad=st.none() | _ANGLES,
        range_m=st.none() | st.floats(0, 100),
        confidence=st.none() | st.sampled_from(Confidence),
        note=st.none() | _WORDS,
        picture=st.none() | _WORDS,
        stamp_s=st.none() | st.floats(0, 2e9),
        recorded_at=st.none() | _TIMES,
        pose=st.none() | _POSES if has_pose else st.none(),
        laser=st.none() | laser_fans(),
    )
    return st.builds(Landmark, label=_LINES) | full


def waypoints(*, has_poses: bool = False) -> st.SearchStrategy[Waypoint]:
    """Gives any waypoint; perhaps with landmarks that were seen from elsewhere."""
    few_landmarks = st.lists(landmarks(has_pose=has_poses), max_size=3).map(tuple)
    return st.builds(
        Waypoint,
        name=_LINES,
        pose=_POSES,
        description=_TEXTS,
        safety_landmarks=few_landmarks,
        functional_landmarks=few_landmarks,
        geometric_features=st.lists(_WORDS, max_size=3).map(tuple),
        stamp_s=st.none() | st.floats(0, 2e9),
        recorded_at=st.none() | _TIMES,
        room_id=st.none() | _WORDS,
        picture=st.none() | _WORDS,
    )
