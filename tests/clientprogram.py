"""A client program for tests: it starts the server that its settings name, and calls tools.

Started as `python clientprogram.py CONFIG PROMPT`. It looks at the map and at a place that is not
there, unless the prompt has one of these words: "nothing" calls nothing, "crash" ends badly, "wait"
never ends.
"""

import json
import os
import sys
from pathlib import Path
from typing import Any

import anyio
from mcp.client import Client
from mcp.client.stdio import StdioServerParameters


async def _work(entry: dict[str, Any], prompt: str) -> str:
    server = StdioServerParameters(command=entry["command"], args=entry["args"])
    async with Client(server) as client:
        if "nothing" in prompt:
            return "ANSWER: nothing"
        await client.call_tool("look_at_map", {})
        await client.call_tool("describe_place", {"place": "R99"})
        if "wait" in prompt:
            await anyio.sleep_forever()
    return f"ANSWER: {os.environ['TEST_SETTING']}, the key is {os.environ['TEST_KEY']}"


def main() -> int:
    """Does what the prompt says."""
    entry = json.loads(Path(sys.argv[1]).read_text())["mcpServers"]["robot"]
    prompt = sys.argv[2]
    if "crash" in prompt:
        sys.stderr.write(f"cannot log in with {os.environ.get('TEST_KEY')}\n")
        return 3
    answer = anyio.run(_work, entry, prompt)
    usage = {"model": {"in": 10, "out": 2}, "other": {"in": 5, "out": 1}}
    sys.stdout.write("starting ...\n" + json.dumps({"said": {"last": answer}, "usage": usage}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
