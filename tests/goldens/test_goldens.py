"""The tools answer as they did when their answers were last recorded."""

import pytest

from goldens.__main__ import RECORDED
from goldens.scenarios import FAST, record, scenarios


@pytest.mark.anyio
@pytest.mark.parametrize("name", FAST)
async def test_every_answer_is_as_it_was_recorded(name: str) -> None:
    recorded = (RECORDED / f"{name}.txt").read_text(encoding="utf-8")
    assert await record(scenarios()[name]) == recorded


def test_what_the_gate_plays_is_recorded() -> None:
    assert set(FAST) <= {path.stem for path in RECORDED.glob("*.txt")} <= set(scenarios())
