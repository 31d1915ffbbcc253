"""Writes the report of a run: report.json, report.csv, report.html, and replays beside trials."""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from urllib.parse import quote

from mapspeak.evaluation.report.album import Album, count_picture_bytes
from mapspeak.evaluation.report.figures import Report, build_report, dump_report
from mapspeak.evaluation.report.gathering import (
    PICTURES,
    TURNS,
    Attempt,
    Run,
    Standing,
    read_course,
    read_run,
)
from mapspeak.evaluation.report.lines import build_csv
from mapspeak.evaluation.report.markup import Html, element, text
from mapspeak.evaluation.report.page import build_document, build_page_body
from mapspeak.evaluation.report.replay import build_replay

__all__ = ["PAGE_LIMIT_BYTES", "WrittenReport", "write_report"]

PAGE_LIMIT_BYTES = 24_000_000
"""A page larger than this is slow to open on a phone."""
BASE64_RATIO = 4 / 3
MARKUP_RATIO = 1.4
"""How much larger a conversation is on the page than in its file, its map included."""
PAGE = "report.html"
REPLAY = "replay.html"


class _Extent(StrEnum):
    """What the page holds of the trials."""

    ALL = "all"
    WITHOUT_PICTURES = "without pictures"
    WITHOUT_REPLAYS = "without replays"


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenReport:
    """What was written.

    Attributes:
        page: report.html.
        figures: report.json.
        lines: report.csv.
        problems: What could not be read, one sentence each.
    """

    page: Path
    figures: Path
    lines: Path
    problems: tuple[str, ...]


def write_report(folder: Path, *, page_limit_bytes: int = PAGE_LIMIT_BYTES) -> WrittenReport:
    """Makes the report of a run, finished or not, from its folder alone, and writes it there.

    Args:
        folder: The run's.
        page_limit_bytes: About how large report.html may become. Above it pictures are linked from
            the folder, and where that is not enough, each trial's replay is a page beside it.

    Raises:
        ConfigError: The folder holds no run.
    """
    run = read_run(folder)
    report = build_report(run)
    extent = _choose_extent(run, page_limit_bytes)
    _write(folder / "report.json", [dump_report(report).decode()])
    _write(folder / "report.csv", [build_csv(run.attempts)])
    if extent is _Extent.WITHOUT_REPLAYS:
        _write_replays(run)
    _write(folder / PAGE, _page(run, report, extent, page_limit_bytes))
    return WrittenReport(
        page=folder / PAGE,
        figures=folder / "report.json",
        lines=folder / "report.csv",
        problems=tuple(f"{each.trial_id}: {each.what}" for each in report.problems),
    )


def _shown(run: Run) -> Iterator[Attempt]:
    """Gives the trials of which there is something to replay."""
    return (each for each in run.attempts if each.standing is not Standing.NOT_RUN)


def _choose_extent(run: Run, limit_bytes: int) -> _Extent:
    """Sees what fits on the page."""
    folders = [each.folder for each in _shown(run)]
    conversations = [folder / TURNS for folder in folders]
    n_bytes = sum(path.stat().st_size for path in conversations if path.exists())
    n_text = MARKUP_RATIO * n_bytes
    if n_text > limit_bytes:
        return _Extent.WITHOUT_REPLAYS
    n_pictures = count_picture_bytes(folder / PICTURES for folder in folders)
    if n_text + BASE64_RATIO * n_pictures > limit_bytes:
        return _Extent.WITHOUT_PICTURES
    return _Extent.ALL


def _page(run: Run, report: Report, extent: _Extent, limit_bytes: int) -> Iterator[str]:
    album = Album(is_inside=extent is _Extent.ALL, root=run.folder)
    is_apart = extent is _Extent.WITHOUT_REPLAYS
    links = {
        each.trial.id: f"{_replay_path(each)}" if is_apart else f"#{each.trial.id}"
        for each in _shown(run)
    }
    note = _say_extent(extent, limit_bytes)
    body = build_page_body(report, run.attempts, links, note)
    replays = () if is_apart else _replays(run, album)
    parts = _with_album([body], replays, album)
    has_links = extent is _Extent.WITHOUT_PICTURES
    return build_document("mapspeak: an evaluation", parts, has_links=has_links)


def _with_album(first: Iterable[Html], replays: Iterable[Html], album: Album) -> Iterator[Html]:
    yield from first
    yield from replays
    yield album.definitions()


def _replays(run: Run, album: Album) -> Iterator[Html]:
    for each in _shown(run):
        yield build_replay(each, read_course(run.folder, each.trial), album)


def _say_extent(extent: _Extent, limit_bytes: int) -> str:
    limit = f"{limit_bytes / 1e6:.0f} MB"
    if extent is _Extent.ALL:
        return "Each opens its replay below; everything is on this page, also the pictures."
    if extent is _Extent.WITHOUT_PICTURES:
        return (
            "Each opens its replay below. With its pictures this page would be larger than "
            f"{limit}, so they are linked from the folder beside it: keep the two together."
        )
    return (
        f"This page would be larger than {limit} with its replays, so each trial's replay is a "
        "page of its own in the folder beside this one: keep the two together."
    )


def _replay_path(attempt: Attempt) -> str:
    return quote(f"trials/{attempt.trial.id}/{REPLAY}")


def _write_replays(run: Run) -> None:
    for each in _shown(run):
        album = Album(is_inside=False, root=each.folder)
        up = "../" * (each.trial.id.count("/") + 2)
        back = element("p", {}, element("a", {"href": f"{up}{PAGE}"}, text("All trials")))
        replay = build_replay(each, read_course(run.folder, each.trial), album)
        parts = _with_album([back], [replay], album)
        title = f"mapspeak: {each.trial.id}"
        _write(each.folder / REPLAY, build_document(title, parts, has_links=True))


def _write(path: Path, parts: Iterable[str]) -> None:
    """Writes a file so that it is there whole or not at all."""
    new = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with new.open("w", encoding="utf-8", errors="replace", newline="\n") as file:
            file.writelines(parts)
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)
