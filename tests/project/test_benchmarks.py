"""A benchmark that runs its cases in processes of their own."""

import os
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path

import pytest

from benchmarks.outages import Course, Part, list_cases, run_all
from mapspeak.ros.messages.fields import Dialect


def die_until(n_deaths: int, folder: Path, course: Course) -> Course:
    """Die as a process does that the system kills, so many times for one part."""
    if course.part is Part.TF:
        n_before = len(list(folder.iterdir()))
        (folder / str(n_before)).touch()
        if n_before < n_deaths:
            os._exit(9)
    course.told.append("done")
    return course


def test_a_case_whose_process_died_is_run_once_again_and_the_others_go_on(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    cases = list_cases([1.0], [Part.TF, Part.CLOCK], [Dialect.ROS1])
    done = list(run_all(cases, partial(die_until, 1, tmp_path)))
    assert {each.part for each in done} == {Part.TF, Part.CLOCK}
    assert all(each.told == ["done"] for each in done)
    assert "ros1 without tf for 1 s: its process died; once again" in capfd.readouterr().err


def test_a_case_that_dies_twice_is_an_error(tmp_path: Path) -> None:
    cases = list_cases([1.0], [Part.TF], [Dialect.ROS1])
    with pytest.raises(BrokenProcessPool):
        list(run_all(cases, partial(die_until, 2, tmp_path)))
