"""The seeding of faults: which are found in a file, and that they spoil what they name alone."""

from pathlib import Path

import pytest

from tools.faults import Fault, find_faults

SOURCE = '''\
"""Text with ümlauts before what is spoilt."""

AT_IMPORT = 2.0 + 1.0


async def drive(speed, turn):
    """Say nothing of -1 < 2.0 here."""
    said = "ü" + "b"; reach = speed * 0.5
    if speed < 1 and not turn:
        await stop()
    return math.radians(turn) - reach


def outer():
    def inner(speed):
        return -speed
    return inner
'''


@pytest.fixture
def found(tmp_path: Path) -> list[Fault]:
    """The faults of a small file."""
    file = tmp_path / "drive.py"
    file.write_text(SOURCE, encoding="utf-8")
    return list(find_faults(file))


def test_each_kind_of_fault_is_found_once_where_it_stands(found: list[Fault]) -> None:
    told = sorted((each.line, each.kind, each.now, each.made) for each in found)
    assert told == [
        (8, "number", "0.5", "1.0"),
        (8, "sign or factor", "speed * 0.5", "(speed / 0.5)"),
        (9, "and for or", "speed < 1 and not turn", "(speed < 1 or not turn)"),
        (9, "bound", "speed < 1", "(speed <= 1)"),
        (9, "sign", "not turn", "(turn)"),
        (10, "dropped await", "await stop()", "pass"),
        (11, "sign or factor", "math.radians(turn) - reach", "(math.radians(turn) + reach)"),
        (11, "unit", "math.radians(turn)", "(turn)"),
        (16, "sign", "-speed", "(speed)"),
    ]


def test_a_fault_changes_its_expression_and_nothing_else(found: list[Fault]) -> None:
    for fault in found:
        start, end = fault.span
        spoilt = fault.spoil(SOURCE)
        compile(spoilt, "drive.py", "exec")
        assert spoilt == SOURCE[:start] + fault.made + SOURCE[end:]
        assert SOURCE[start:end] == fault.now
