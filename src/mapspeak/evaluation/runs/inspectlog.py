"""The run as a log of inspect-ai, for `inspect view` and other readers of such logs.

The format is that of inspect-ai's log files (version 2): a zip of JSON with a header, summaries and
a file for each sample. A sample is a task in a world by one agent; its epochs are the trials.
"""

import base64
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

from mapspeak.atomic import replacing
from mapspeak.evaluation.trials import PICTURES, Trial, TrialResult, Turn, read_turns, trial_folder

LOG = "inspect.eval"
SCORER = "truth"
RIGHT, WRONG = "C", "I"
"""Scores of inspect-ai for right and wrong."""


def write_log(run: Path, results: Sequence[TrialResult], versions: Mapping[str, str]) -> Path:
    """Write the log of a run into its folder.

    Args:
        versions: Of everything that took part, by name.
    """
    summaries = []
    with replacing(run / LOG) as file, ZipFile(file, "w", ZIP_DEFLATED, compresslevel=1) as log:
        for result in results:
            sample = _sample(run, result)
            name = f"samples/{sample['id']}_epoch_{sample['epoch']}.json"
            log.writestr(name, json.dumps(sample))
            summaries.append(_summary(sample))
        log.writestr("summaries.json", json.dumps(summaries))
        header = _header(results, versions)
        log.writestr("header.json", json.dumps(header))
    return run / LOG


def _header(results: Sequence[TrialResult], versions: Mapping[str, str]) -> dict[str, Any]:
    now = datetime.now(UTC).isoformat(timespec="seconds")
    ids = list(dict.fromkeys(_sample_id(result.trial) for result in results))
    tasks = ", ".join(dict.fromkeys(result.trial.task for result in results))
    n_right = sum(result.score.is_success for result in results)
    accuracy = n_right / len(results) if results else 0.0
    metric = {"name": "accuracy", "value": accuracy, "params": {}}
    return {
        "version": 2,
        "status": "success",
        "eval": {
            "eval_id": _id_of(f"eval {now}"),
            "run_id": _id_of(f"run {now}"),
            "task_id": _id_of(tasks),
            "created": now,
            "task": tasks or "none",
            "dataset": {"name": "mapspeak", "samples": len(ids), "sample_ids": ids},
            "model": ", ".join(dict.fromkeys(result.trial.answerer for result in results)),
            "config": {"epochs": max((result.trial.number for result in results), default=1)},
            "packages": dict(versions),
        },
        "plan": {"name": "plan", "steps": [], "config": {}},
        "results": {
            "total_samples": len(results),
            "completed_samples": sum(not result.state.is_broken for result in results),
            "scores": [
                {"name": SCORER, "scorer": SCORER, "params": {}, "metrics": {"accuracy": metric}}
            ],
        },
        "stats": {"started_at": now, "completed_at": now},
    }


def _sample(run: Path, result: TrialResult) -> dict[str, Any]:
    trial, score = result.trial, result.score
    shown = ("driven_m", "shortest_m", "robot_s", "wall_s", "cpu_s", "n_calls")
    figures = {name: getattr(result, name) for name in shown}
    usage = {}
    if result.n_input_tokens is not None and result.n_output_tokens is not None:
        n_read, n_written = result.n_input_tokens, result.n_output_tokens
        spent = {"input_tokens": n_read, "output_tokens": n_written}
        usage = {trial.answerer: {**spent, "total_tokens": n_read + n_written}}
    sample: dict[str, Any] = {
        "id": _sample_id(trial),
        "epoch": trial.number,
        "uuid": _id_of(trial.id),
        "input": result.prompt,
        "target": "",
        "messages": list(_messages(run, trial)),
        "output": {"model": trial.answerer, "choices": [], "completion": result.answer},
        "scores": {
            SCORER: {
                "value": RIGHT if score.is_success else WRONG,
                "answer": result.answer,
                "explanation": score.reason,
                "metadata": {**score.figures, "failure": score.failure, "state": result.state},
            }
        },
        "metadata": {"seed": trial.seed, "world": trial.world, **figures},
        "store": {},
        "events": [],
        "model_usage": usage,
        "total_time": result.wall_s,
        "attachments": {},
    }
    if result.error is not None:
        said = result.error
        sample["error"] = {"message": said, "traceback": said, "traceback_ansi": said}
    return sample


def _summary(sample: Mapping[str, Any]) -> dict[str, Any]:
    kept = ("id", "epoch", "uuid", "input", "target", "metadata", "scores", "model_usage")
    return {
        **{name: sample[name] for name in (*kept, "total_time")},
        "message_count": len(sample["messages"]),
        "completed": True,
        **({"error": sample["error"]["message"]} if "error" in sample else {}),
    }


def _messages(run: Path, trial: Trial) -> Iterator[dict[str, Any]]:
    """Yield the conversation; a call and its answer have the same id."""
    folder = trial_folder(run, trial)
    for number, turn in enumerate(read_turns(folder)):
        message: dict[str, Any] = {"id": _id_of(f"{trial.id} {number}"), "content": turn.text}
        if turn.role in ("system", "user"):
            message["role"] = turn.role
        elif turn.role == "tool":
            message["role"] = "tool"
            message["content"] = [
                {"type": "text", "text": turn.text},
                *_images(turn, folder / PICTURES),
            ]
            message["tool_call_id"] = f"call-{number - 1}"
            message["function"] = "" if turn.call is None else turn.call.tool
            if turn.is_error:
                message["error"] = {"type": "unknown", "message": turn.text}
        else:
            message["role"] = "assistant"
            if turn.call is not None:
                call = {"function": turn.call.tool, "arguments": turn.call.arguments}
                message["tool_calls"] = [{"id": f"call-{number}", "type": "function", **call}]
        yield message


def _images(turn: Turn, pictures: Path) -> Iterator[dict[str, Any]]:
    for path in (pictures / name for name in turn.pictures):
        if path.is_file():
            media_type = "image/jpeg" if path.suffix == ".jpg" else "image/png"
            data = base64.b64encode(path.read_bytes()).decode()
            yield {"type": "image", "image": f"data:{media_type};base64,{data}"}


def _sample_id(trial: Trial) -> str:
    """Return the id shared by all trials of a kind, without slashes, because it names a file."""
    return trial.id.rpartition("/")[0].replace("/", " ")


def _id_of(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:22]
