"""A run's folder as a run finds it: new, one to go on with, or nothing of ours."""

import errno
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from filelock import FileLock, Timeout
from pydantic import ValidationError

from mapspeak.errors import ConfigError
from mapspeak.evaluation.trials import (
    RunPlan,
    Sitting,
    Trial,
    TrialState,
    is_done,
    read_plan,
    read_result,
    trial_folder,
)
from mapspeak.evaluation.trials.records import PLAN, RESULT, say_fault

__all__ = ["NO_ROOM", "Found", "alone_in", "check_folder", "take_up", "writing_to"]

LOCK = ".run.lock"
TRIALS = "trials"
NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS})
"""Nothing can be written any more, by anyone."""
CANNOT_WRITE = NO_ROOM | {errno.EACCES, errno.EPERM, errno.ENOTDIR, errno.ENAMETOOLONG}
BROKEN = (TrialState.CRASHED, TrialState.HUNG)


@dataclass(frozen=True, slots=True)
class Found:
    """What there is to go on with.

    Attributes:
        plan: What run.json is to hold: what is asked for now, and what was finished before.
        notes: What whoever asked should know, one sentence each.
    """

    plan: RunPlan
    notes: tuple[str, ...]


@contextmanager
def writing_to(folder: Path) -> Generator[None]:
    """Says it in our words where a folder cannot be written to.

    Raises:
        ConfigError: The disk is full, or the place is not ours to write to.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in CANNOT_WRITE:
            raise
        raise ConfigError(
            f"{folder} cannot be written to: {error.strerror or error}.",
            hint="Make room or choose another --out; started again, finished trials are kept.",
        ) from error


def check_folder(folder: Path) -> None:
    """Makes a folder where there is none, and leaves one alone that holds something else.

    Raises:
        ConfigError: It holds other things and no run, or cannot be written to.
    """
    with writing_to(folder):
        folder.mkdir(parents=True, exist_ok=True)
        there = {path.name for path in folder.iterdir()} - {LOCK}
    if there and not there & {PLAN, TRIALS}:
        raise ConfigError(
            f"{folder} holds other things, such as {min(there)}, and no evaluation.",
            hint="Choose a new or an empty folder with --out.",
        )


@contextmanager
def alone_in(folder: Path) -> Generator[None]:
    """Keeps other runs out of a folder; a run that was killed keeps nobody out.

    Raises:
        ConfigError: Another run is at work in it.
    """
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise ConfigError(
            f"Another run is at work in {folder}.", hint="Wait for it, or choose another --out."
        ) from error
    try:
        yield
    finally:
        lock.release()


def take_up(folder: Path, plan: RunPlan, *, has_retry: bool = False) -> Found:
    """Compares what is asked for with what is there, and throws away what has to be run again.

    Args:
        folder: The run's.
        plan: What is asked for now.
        has_retry: Trials that crashed or hung are run again.

    Raises:
        ConfigError: The folder cannot be gone on with; nothing was thrown away.
    """
    _check_ids(plan)
    before = _read_before(folder)
    if before is not None:
        _check_seed(folder, before, plan)
    asked = (*plan.preparations, *plan.trials)
    cut_off, broken = _sort_results(folder, asked)
    again = (*cut_off, *(broken if has_retry else ()))
    for trial in again:
        (trial_folder(folder, trial) / RESULT).unlink()
    notes = [*_say_cut_off(cut_off), *_say_broken(broken if has_retry else ())]
    if before is None:
        return Found(plan, tuple(notes))
    kept = tuple(each for each in before.trials if each not in plan.trials)
    kept = tuple(each for each in kept if is_done(folder, each))
    merged = replace(
        plan,
        trials=(*plan.trials, *kept),
        preparations=_merge_preparations(folder, plan, before, kept),
        earlier=_list_sittings(folder, plan, before),
    )
    return Found(merged, (*notes, *_say_kept(kept), *_say_versions(before, plan)))


def _check_ids(plan: RunPlan) -> None:
    """Two trials in one folder would write over each other."""
    known: dict[str, Trial] = {}
    for trial in (*plan.preparations, *plan.trials):
        other = known.setdefault(trial.id, trial)
        if other != trial:
            first, second = _differences(other, trial)
            raise ConfigError(
                f"{first} and {second} would lie in the same folder, {trial.id}.",
                hint="Run one of them in a folder of its own, with --out, or give it another name.",
            )


def _differences(first: Trial, second: Trial) -> tuple[str, str]:
    pairs = [(first.world, second.world), (first.agent, second.agent)]
    named = [pair for pair in pairs if pair[0] != pair[1]]
    return named[0] if named else (first.answerer, second.answerer)


def _read_before(folder: Path) -> RunPlan | None:
    try:
        return read_plan(folder)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"{folder / PLAN} cannot be read: {say_fault(error)}.",
            hint="Delete it and start the evaluation again with the same options; "
            "finished trials are kept.",
        ) from error


def _check_seed(folder: Path, before: RunPlan, plan: RunPlan) -> None:
    had, has = before.options.get("seed"), plan.options["seed"]
    if had is not None and had != has:
        raise ConfigError(
            f"{folder} holds an evaluation with the seed {had}, not {has}.",
            hint="Go on with that seed, or choose another folder with --out.",
        )


def _sort_results(folder: Path, trials: Iterable[Trial]) -> tuple[list[Trial], list[Trial]]:
    """Gives the trials whose result was cut off, and those that broke."""
    cut_off: list[Trial] = []
    broken: list[Trial] = []
    for trial in trials:
        if not is_done(folder, trial):
            continue
        try:
            result = read_result(folder, trial)
        except ValidationError as error:
            # What is no JSON was cut off while it was written: there is nothing in it to lose.
            if error.errors(include_url=False)[0]["type"] != "json_invalid":
                raise _not_understood(folder, trial, error) from error
            cut_off.append(trial)
            continue
        if result.trial != trial:
            raise _not_the_same(folder, result.trial)
        if result.state in BROKEN:
            broken.append(trial)
    return cut_off, broken


def _not_understood(folder: Path, trial: Trial, error: ValidationError) -> ConfigError:
    return ConfigError(
        f"{trial_folder(folder, trial) / RESULT} is no result: {say_fault(error)}.",
        hint="Use the mapspeak that wrote it, or delete it to run that trial again.",
    )


def _not_the_same(folder: Path, found: Trial) -> ConfigError:
    return ConfigError(
        f"{trial_folder(folder, found)} holds another trial, with the seed {found.seed}, "
        f"of {found.agent} in {found.world}.",
        hint="Go on with the options of that evaluation, or choose another folder with --out.",
    )


def _merge_preparations(
    folder: Path, plan: RunPlan, before: RunPlan, kept: tuple[Trial, ...]
) -> tuple[Trial, ...]:
    """Keeps those that finished trials started from; one that is in the report is none."""
    counted = {*plan.trials, *kept}
    done = (each for each in before.preparations if is_done(folder, each))
    return tuple(each for each in dict.fromkeys((*plan.preparations, *done)) if each not in counted)


def _list_sittings(folder: Path, plan: RunPlan, before: RunPlan) -> tuple[Sitting, ...]:
    """Adds the last sitting to those before it where something has changed since and it left any.

    A sitting whose results were all there before, or that came to none, has nothing to tell.
    """
    if (before.versions, before.options) == (plan.versions, plan.options):
        return before.earlier
    n_done = sum(is_done(folder, each) for each in before.trials)
    n_before = before.earlier[-1].n_done if before.earlier else 0
    if n_done <= n_before:
        return before.earlier
    last = Sitting(versions=before.versions, options=before.options, n_done=n_done)
    return (*before.earlier, last)


def _say_cut_off(trials: list[Trial]) -> Iterator[str]:
    if trials:
        said = "1 result was" if len(trials) == 1 else f"{len(trials)} results were"
        again = "is run again" if len(trials) == 1 else "are run again"
        yield f"{said} cut off and {again}: {', '.join(trial.id for trial in trials)}."


def _say_broken(trials: Iterable[Trial]) -> Iterator[str]:
    n_trials = len(list(trials))
    if n_trials:
        yield f"{n_trials} broken trial{' is' if n_trials == 1 else 's are'} run again."


def _say_kept(kept: tuple[Trial, ...]) -> Iterator[str]:
    if len(kept) == 1:
        yield "1 trial that is not asked for any more has a result, and stays in the report."
    elif kept:
        yield (
            f"{len(kept)} trials that are not asked for any more have results, "
            "and stay in the report."
        )


def _say_versions(before: RunPlan, plan: RunPlan) -> Iterator[str]:
    for name, now in plan.versions.items():
        had = before.versions.get(name)
        if had is not None and had != now:
            yield f"Earlier results were made with {name} {had}, now it is {now}."
