"""Record the answers of all tools anew, or hold today's against what was recorded.

python -m goldens [--check] [NAME...]
"""

import argparse
import difflib
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import anyio

from goldens.scenarios import record, scenarios

RECORDED = Path(__file__).parent / "recorded"
MOST_LINES = 200
"""Of a difference, that are shown."""


def main() -> int:
    """Return 1 where something differs."""
    parser = argparse.ArgumentParser(prog="goldens", description=__doc__)
    parser.add_argument("names", nargs="*", help="of scenarios; all when left out")
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    options = parser.parse_args()
    names = options.names or list(scenarios())
    n_changed = 0
    with ProcessPoolExecutor(os.cpu_count()) as workers:
        for name, text in zip(names, workers.map(_record, names), strict=True):
            path = RECORDED / f"{name}.txt"
            before = path.read_text(encoding="utf-8") if path.exists() else ""
            n_changed += before != text
            n_calls = text.count("\n\n[") + 1
            sys.stdout.write(f"{name}: {n_calls} calls, {_verdict(before, text)}\n")
            if options.check:
                sys.stdout.writelines(_difference(name, before, text))
            else:
                RECORDED.mkdir(exist_ok=True)
                path.write_text(text, encoding="utf-8")
            sys.stdout.flush()
    return int(options.check and n_changed > 0)


def _record(name: str) -> str:
    return anyio.run(record, scenarios()[name])


def _verdict(before: str, after: str) -> str:
    return "equal" if before == after else "different" if before else "new"


def _difference(name: str, before: str, after: str) -> list[str]:
    lines = difflib.unified_diff(
        before.splitlines(keepends=True), after.splitlines(keepends=True), name, name, n=1
    )
    return list(lines)[:MOST_LINES]


if __name__ == "__main__":
    sys.exit(main())
