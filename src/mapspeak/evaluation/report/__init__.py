"""The report of a run: its figures, a line for each trial, and a page that replays every one."""

from mapspeak.evaluation.report.gathering import read_run
from mapspeak.evaluation.report.writing import PAGE_LIMIT_BYTES, WrittenReport, write_report

__all__ = ["PAGE_LIMIT_BYTES", "WrittenReport", "read_run", "write_report"]
