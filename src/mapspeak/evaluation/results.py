"""The demo's result: figures as JSON, the map as map_server files, the page to look at."""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict, Field

from mapspeak.evaluation.client import CallRecord, Picture
from mapspeak.evaluation.page import Page, build_page
from mapspeak.evaluation.policy import PolicyResult, Stage
from mapspeak.evaluation.recorder import Recorder
from mapspeak.evaluation.scoring import FireToolScore, RoomScore, slam_rmse_m
from mapspeak.geometry import Pose
from mapspeak.spatial.mapfiles import write_map
from mapspeak.spatial.picture import Line, MapLayers, draw_map

__all__ = ["DemoReport", "Task2Report", "Task3Report", "write_results"]

ENOUGH_COVERAGE = 0.9
"""The paper's criterion for Task 1."""


class _Report(BaseModel):
    model_config = ConfigDict(frozen=True)


class PoseFigures(_Report):
    """A pose in the map frame, by the simulator's truth."""

    x: float
    y: float
    yaw_rad: float

    @classmethod
    def of(cls, pose: Pose) -> Self:
        """Makes it from a pose."""
        return cls(x=round(pose.x, 3), y=round(pose.y, 3), yaw_rad=round(pose.yaw_rad, 4))


class Task2Report(_Report):
    """Go to the smallest room."""

    success: bool = False
    chosen_room: str | None = None
    chosen_room_area_m2: float | None = None
    smallest_room_area_m2: float | None = None
    final_pose: PoseFigures | None = None

    @classmethod
    def of(cls, score: RoomScore) -> Self:
        """Makes it from a score."""
        chosen_m2, smallest_m2 = score.chosen_room_area_m2, score.smallest_room_area_m2
        return cls(
            success=score.is_success,
            chosen_room=score.chosen_room,
            chosen_room_area_m2=None if chosen_m2 is None else round(chosen_m2, 2),
            smallest_room_area_m2=None if smallest_m2 is None else round(smallest_m2, 2),
            final_pose=PoseFigures.of(score.final_pose),
        )


class Task3Report(_Report):
    """Go to the tool for fire."""

    success: bool = False
    waypoint: str | None = None
    nearest_object: str | None = None
    distance_to_object_m: float | None = None

    @classmethod
    def of(cls, score: FireToolScore, waypoint: str | None) -> Self:
        """Makes it from a score and the waypoint that was chosen."""
        return cls(
            success=score.is_success and waypoint is not None,
            waypoint=waypoint,
            nearest_object=score.nearest,
            distance_to_object_m=None if score.distance_m is None else round(score.distance_m, 2),
        )


class DemoReport(_Report):
    """Everything the demo measured, from the simulator's truth."""

    world: str
    seed: int
    is_finished: bool = Field(description="all three tasks were carried out to their end")
    task1_success: bool = Field(description="90 % covered, as the paper demands, and recorded")
    coverage_paper_ratio: float | None
    coverage_recall: float | None
    coverage_precision: float | None
    path_length_m: float
    n_goals: int
    n_tool_calls: int
    collisions: int
    sim_time_s: float
    wall_time_s: float
    slam_rmse_m: float | None
    task2: Task2Report
    task3: Task3Report

    @property
    def is_success(self) -> bool:
        """True when all three tasks succeeded."""
        return self.is_finished and self.task1_success and self.task2.success and self.task3.success

    def summary(self) -> str:
        """Gives the result in three lines."""
        return "\n".join(
            f"Task {task}  {'done' if is_right else 'FAILED'}  {prompt}: {here}"
            for (task, prompt, here, _), is_right in zip(
                _tasks(self),
                (self.task1_success, self.task2.success, self.task3.success),
                strict=True,
            )
        )

    @classmethod
    def of(
        cls,
        world: str,
        seed: int,
        *,
        recorder: Recorder,
        calls: Sequence[CallRecord],
        result: PolicyResult | None,
        wall_time_s: float,
    ) -> Self:
        """Scores a run, also one that was cut short."""
        states = recorder.states()
        ends = recorder.stage_ends
        coverage = recorder.last_coverage
        task2, task3 = Task2Report(), Task3Report()
        if Stage.SMALLEST_ROOM in ends and result is not None:
            score = recorder.scorer.score_smallest_room(ends[Stage.SMALLEST_ROOM].pose)
            task2 = Task2Report.of(score)
        if Stage.FIRE_TOOL in ends and result is not None:
            fire = recorder.scorer.score_fire_tool(ends[Stage.FIRE_TOOL].pose)
            task3 = Task3Report.of(fire, result.fire_waypoint)
        is_covered = coverage is not None and coverage.recall >= ENOUGH_COVERAGE
        return cls(
            world=world,
            seed=seed,
            is_finished=result is not None,
            task1_success=is_covered and any(c.tool == "write_semantic_data" for c in calls),
            coverage_paper_ratio=round(coverage.paper_ratio, 4) if coverage else None,
            coverage_recall=round(coverage.recall, 4) if coverage else None,
            coverage_precision=round(coverage.precision, 4) if coverage else None,
            path_length_m=round(states[-1].driven_m, 2) if states else 0.0,
            n_goals=sum(call.tool == "navigate_to" for call in calls),
            n_tool_calls=len(calls),
            collisions=states[-1].n_collisions if states else 0,
            sim_time_s=round(states[-1].time_s, 1) if states else 0.0,
            wall_time_s=round(wall_time_s, 1),
            slam_rmse_m=round(slam_rmse_m(states), 4) if states else None,
            task2=task2,
            task3=task3,
        )


def write_results(report: DemoReport, recorder: Recorder, calls: Sequence[CallRecord]) -> None:
    """Writes report.json, map.yaml and map.pgm, trajectory.png and report.html into the folder."""
    folder = recorder.folder
    (folder / "report.json").write_text(report.model_dump_json(indent=2) + "\n", encoding="utf-8")
    if recorder.last_map is None:
        return
    write_map(recorder.last_map, folder / "map.yaml")
    way = tuple(state.pose.point for state in recorder.states())
    lines = (Line(points=way),) if len(way) > 1 else ()
    trajectory = Picture(
        draw_map(recorder.last_map, layers=MapLayers(lines=lines)).png, "image/png"
    )
    (folder / "trajectory.png").write_bytes(trajectory.data)
    page = Page(
        title=f"mapspeak demo: {report.world}, seed {report.seed}",
        verdict=_verdict(report),
        is_success=report.is_success,
        figures=_figures(report),
        beside_paper=_beside_paper(report),
        moments=recorder.moments,
        trajectory=trajectory,
        semantic_map=_read_if_there(folder / "semantic_map.yaml"),
        calls=calls,
    )
    (folder / "report.html").write_text(build_page(page), encoding="utf-8")


def _verdict(report: DemoReport) -> str:
    if report.is_success:
        return "All three of the paper's tasks succeeded, scored from the simulator's truth."
    if not report.is_finished:
        return "The run was cut short; this is what was gathered."
    tasks = (report.task1_success, report.task2.success, report.task3.success)
    failed = [f"Task {number}" for number, is_right in enumerate(tasks, start=1) if not is_right]
    return f"{' and '.join(failed)} failed, scored from the simulator's truth."


def _figures(report: DemoReport) -> list[tuple[str, str]]:
    return [
        ("of the floor in sight shown as free", _percent(report.coverage_recall)),
        ("coverage by the paper's ratio", _percent(report.coverage_paper_ratio)),
        ("of the mapped free floor truly free", _percent(report.coverage_precision)),
        ("driven", f"{report.path_length_m:.1f} m"),
        ("drives", str(report.n_goals)),
        ("tool calls", str(report.n_tool_calls)),
        ("collisions", str(report.collisions)),
        ("robot time", f"{report.sim_time_s:.0f} s"),
        ("wall time", f"{report.wall_time_s:.1f} s"),
        ("SLAM error (RMSE)", "none" if report.slam_rmse_m is None else f"{report.slam_rmse_m} m"),
    ]


def _tasks(report: DemoReport) -> list[tuple[int, str, str, str]]:
    """Gives number, prompt, mapspeak's result and the paper's results of each task."""
    room, smallest_m2 = report.task2.chosen_room, report.task2.smallest_room_area_m2
    tool, distance_m = report.task3.nearest_object, report.task3.distance_to_object_m
    covered = (
        f"{_percent(report.coverage_paper_ratio)} by the paper's ratio, "
        f"{_percent(report.coverage_recall)} of the floor in sight shown as free"
    )
    return [
        (1, "Update the map while moving.", covered, "97.83 %; 99.78 %"),
        (
            2,
            "Go to the smallest room.",
            f"stands in {room}; the smallest has {smallest_m2} m2",
            "26/30; 28/30",
        ),
        (
            3,
            "Fire detected nearby. Navigate to the tool used for it.",
            f"{distance_m} m from {tool}, in sight",
            "30/30; 30/30",
        ),
    ]


def _beside_paper(report: DemoReport) -> list[tuple[str, str, str]]:
    return [(f"{task} {prompt}", here, paper) for task, prompt, here, paper in _tasks(report)]


def _percent(ratio: float | None) -> str:
    return "none" if ratio is None else f"{100 * ratio:.2f} %"


def _read_if_there(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.exists() else ""
