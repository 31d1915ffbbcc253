import json
from pathlib import Path

import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.server.wire.calllog import CallLog
from served import connect

pytestmark = pytest.mark.anyio


async def test_every_call_is_noted_with_its_answer_and_pictures(tmp_path: Path) -> None:
    log = CallLog(tmp_path / "log" / "calls.jsonl")
    async with connect(FakeRobot(two_rooms()), tmp_path, call_log=log) as client:
        await client.call_tool("look_at_map", {"layers": ["rooms"]})
        await client.call_tool("get_robot_pose", {})
        await client.call_tool("describe_place", {"place": "R99"})
        await client.call_tool("look_at_map", {"zoom": 3})
    look, pose, unknown, wrong = map(json.loads, log.path.read_text().splitlines())
    assert look["arguments"] == {"layers": ["rooms"]}
    assert "## Rooms" in look["text"]
    assert (log.pictures / look["pictures"][0]).read_bytes().startswith(b"\x89PNG")
    assert pose["report"]["pose"]["x"] == 1.5
    assert [unknown["is_error"], wrong["is_error"]] == [True, True]
    assert "R99" in unknown["text"]
    assert "no argument zoom" in wrong["text"]
    assert [each["number"] for each in (look, pose, unknown, wrong)] == [1, 2, 3, 4]


async def test_a_call_with_half_a_sign_is_refused_and_noted(tmp_path: Path) -> None:
    log = CallLog(tmp_path / "calls.jsonl")
    with log.noting("describe_place", {"place": "\ud800"}) as note:
        note.error = "described \ud800"
    (line,) = log.path.read_text().splitlines()
    assert json.loads(line)["arguments"] == {"place": "\ud800"}
