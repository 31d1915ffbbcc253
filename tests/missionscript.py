"""A scripted client's conversation, from a first patrol to a saved skill, as the page shows it."""

import re
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mcp_types import CallToolResult

from guarding import make_guard
from mapspeak.safety import Approval, CommandKind, Otherwise, Policy
from missioning import missions
from served import text_of
from skillmaking import FakeSkill, spec

PATROL = """\
- drive: R2
- look
- ask: Is the floor free?
  answers: [free, blocked]
  otherwise: blocked
  as: floor
- fallback:
  - check: {value: "{floor}", is: free}
  - note: something lies on the floor
- drive: R1
"""
WITH_ROOM = PATROL.replace("drive: R2", "drive: '{room}'")
HEAD = """\
# A conversation: from "patrol" to a saved skill

A scripted client over a robot in two rooms.
The text is what the tools answer; `./run docs` writes it anew.
The policy wants a person's word for drives. Times are left out.

"""


async def play_transcript() -> str:
    """Gives the conversation as a page."""
    policy = Policy(
        approval=Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    )
    parts = [HEAD]
    with TemporaryDirectory() as name:
        folder = Path(name)
        guard = make_guard(folder, policy)
        horn = FakeSkill(spec("sound_horn", description="Sounds the horn once"))
        async with missions(folder, horn, guard=guard) as caller:

            async def call(tool: str, /, **arguments: Any) -> None:  # noqa: ANN401
                result = await caller.client.call_tool(tool, arguments)
                parts.append(_show(tool, arguments, result, folder))

            def say(words: str) -> None:
                parts.append(f"**{words}**\n\n")

            say("Patrol the next room, and tell me when the floor is not free.")
            await call("run_mission", tree=PATROL)
            (request,) = guard.approvals.room.list_waiting()
            say(f"The person types `mapspeak approve {_plain(request, folder)}`.")
            guard.approvals.room.approve(request)
            await call("run_mission", tree=PATROL)
            await call("answer_mission")
            await call("answer_mission", answer="blocked")
            await caller.until("succeeded")
            await call("skill_status")
            say("Good. Do that for any room from now on; call it patrol.")
            await call(
                "save_mission",
                name="patrol",
                tree=WITH_ROOM,
                sentence="Looks whether the floor of a room is free",
                parameters={"room": "R2"},
            )
            say("But sound the horn before you go in.")
            await call("save_mission", name="patrol", correction="sound the horn before going in")
            await call("show_missions")
            tree = "- sound_horn\n- patrol: R1\n"
            await call("run_mission", tree=tree)
            (request,) = guard.approvals.room.list_waiting()
            say(f"The person types `mapspeak approve {_plain(request, folder)}`.")
            guard.approvals.room.approve(request)
            await call("run_mission", tree=tree)
            await call("answer_mission", answer="free")
            await caller.until("succeeded")
            await call("skill_status")
    return "".join(parts).rstrip() + "\n"


def _show(tool: str, arguments: Mapping[str, Any], result: CallToolResult, folder: Path) -> str:
    shown = [f"> {tool}"]
    for name, value in arguments.items():
        lines = str(value).rstrip().splitlines()
        shown.append(f">   {name}: {lines[0]}" if len(lines) == 1 else f">   {name}:")
        shown += [f">     {line}" for line in lines] if len(lines) > 1 else []
    n_pictures = sum(each.type == "image" for each in result.content)
    answer = text_of(result) + "\n(a picture)" * n_pictures
    return "```text\n" + "\n".join(shown) + "\n\n" + _plain(answer, folder) + "\n```\n\n"


def _plain(text: str, folder: Path) -> str:
    text = text.replace(str(folder), "...").replace("python -m ", "")
    text = re.sub(r"\b[0-9a-f]{4}-(\d+)\b", r"a1b2-\1", text)
    return re.sub(r"after [\d.]+ s", "after ... s", text)
