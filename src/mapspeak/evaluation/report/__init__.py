"""The page of a run: the paper's table with ours beside it, and every trial to be replayed."""

from mapspeak.evaluation.report.page import PAGE_LIMIT_BYTES, write_page

__all__ = ["PAGE_LIMIT_BYTES", "write_page"]
