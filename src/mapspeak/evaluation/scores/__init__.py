"""Scores: the truth of a world, what a trial left behind, and the judges that compare the two."""

from mapspeak.evaluation.scores.answers import (
    Evidence,
    judge_choice,
    judge_number,
    no_answer,
    read_letters,
    read_number,
    read_point,
    read_said,
    read_word,
    verdict,
)
from mapspeak.evaluation.scores.judging import (
    count_known,
    judge_coverage,
    judge_near,
    judge_pose,
    judge_room,
    judge_route,
    judge_thing,
    spl,
)
from mapspeak.evaluation.scores.rows import (
    Interval,
    TableRow,
    bootstrap_interval,
    count_rows,
    wilson_interval,
)
from mapspeak.evaluation.scores.site import BESIDE_M, GroundTruth, TruePassage

__all__ = [
    "BESIDE_M",
    "Evidence",
    "GroundTruth",
    "Interval",
    "TableRow",
    "TruePassage",
    "bootstrap_interval",
    "count_known",
    "count_rows",
    "judge_choice",
    "judge_coverage",
    "judge_near",
    "judge_number",
    "judge_pose",
    "judge_room",
    "judge_route",
    "judge_thing",
    "no_answer",
    "read_letters",
    "read_number",
    "read_point",
    "read_said",
    "read_word",
    "spl",
    "verdict",
    "wilson_interval",
]
