"""The log of a run, by its own files and, where the extra `eval` is there, by inspect-ai itself."""

import importlib.util
import json
import zipfile
from pathlib import Path

import pytest

from mapspeak.evaluation.runs.inspectlog import write_log
from mapspeak.evaluation.trials import Failure, TrialState, read_results, write_result
from reportmaking import make_result, make_trial, write_trial

HAS_INSPECT = importlib.util.find_spec("inspect_ai") is not None


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """The log of a success, a failure and a trial that crashed."""
    write_trial(tmp_path, make_trial(1), n_input_tokens=900, n_output_tokens=20)
    write_trial(tmp_path, make_trial(2), failure=Failure.WRONG_SIZE)
    crashed = make_result(
        make_trial(3), failure=Failure.BROKEN, state=TrialState.CRASHED, error="a bug"
    )
    write_result(tmp_path, crashed)
    return write_log(tmp_path, read_results(tmp_path), {"mapspeak": "1.2.3"})


def test_trials_of_a_kind_are_epochs_of_one_sample(log: Path) -> None:
    with zipfile.ZipFile(log) as archive:
        summaries = json.loads(archive.read("summaries.json"))
        header = json.loads(archive.read("header.json"))
    assert [(each["epoch"], each["scores"]["truth"]["value"]) for each in summaries] == [
        (1, "C"),
        (2, "I"),
        (3, "I"),
    ]
    assert {each["id"] for each in summaries} == {"smallest-room flat scripted picture-table"}
    assert summaries[2]["error"] == "a bug"
    assert header["eval"]["packages"] == {"mapspeak": "1.2.3"}
    assert header["results"]["scores"][0]["metrics"]["accuracy"]["value"] == pytest.approx(1 / 3)


def test_a_call_and_its_answer_with_its_picture_belong_together(log: Path) -> None:
    with zipfile.ZipFile(log) as archive:
        name = "samples/smallest-room flat scripted picture-table_epoch_1.json"
        sample = json.loads(archive.read(name))
    (calling,) = [each for each in sample["messages"] if "tool_calls" in each]
    (answer,) = [each for each in sample["messages"] if each["role"] == "tool"]
    assert calling["tool_calls"][0]["id"] == answer["tool_call_id"]
    assert [part["type"] for part in answer["content"]] == ["text", "image"]
    assert answer["content"][1]["image"].startswith("data:image/png;base64,")


@pytest.mark.skipif(not HAS_INSPECT, reason="needs the extra eval: ./run test-eval")
@pytest.mark.filterwarnings("default")
def test_inspect_reads_the_log_as_one_of_its_own(log: Path) -> None:
    from inspect_ai.log import read_eval_log  # noqa: PLC0415 - an optional extra

    read = read_eval_log(str(log))
    assert (read.status, read.eval.task, read.eval.model) == (
        "success",
        "smallest-room",
        "scripted",
    )
    assert read.samples is not None
    first = read.samples[0]
    assert first.model_usage["scripted"].total_tokens == 920
    assert first.scores is not None
    assert first.scores["truth"].value == "C"
    assert [message.role for message in first.messages] == [
        *("user", "assistant", "tool", "assistant", "assistant")
    ]
