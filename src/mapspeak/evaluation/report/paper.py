"""The table of the paper that all of this is measured against, as it was printed."""

from dataclasses import dataclass

PAPER_TASKS = ("explore", "smallest-room", "fire-tool")
"""The names of its Tasks 1 to 3 here."""

PAPER_NOTE = (
    "The paper's figures are as it printed them: one warehouse in NVIDIA Isaac Sim, Task 1 once, "
    "Tasks 2 and 3 thirty times each, Claude Sonnet 4.6 and GPT-5.5. They were not measured here, "
    "and another simulator, other worlds and another robot stand behind ours. Its coverage is the "
    "free area of the map over the free area of the building, wherever it lies; ours is given by "
    "that ratio too, and as recall: the share of the floor in sight that the map shows as free. "
    "What is known is the share of the reachable floor that the map knows, be it as free or as "
    "solid. The intervals of its counts are ours, after Wilson."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperRow:
    """What the paper printed of one model.

    Attributes:
        coverage_paper_ratio: Task 1, between 0 and 1; one run.
        n_smallest_room: Of thirty trials of Task 2, how many were done.
    """

    model: str
    coverage_paper_ratio: float
    n_smallest_room: int
    n_fire_tool: int
    n_trials: int = 30


PAPER_ROWS = (
    PaperRow(
        model="Claude Sonnet 4.6", coverage_paper_ratio=0.9783, n_smallest_room=26, n_fire_tool=30
    ),
    PaperRow(model="GPT-5.5", coverage_paper_ratio=0.9978, n_smallest_room=28, n_fire_tool=30),
)
