"""Writes what the documents say about tools and errors, from the source: `./run docs`.

A table stands between `<!-- tools -->` and `<!-- /tools -->` in each document that has one, and
likewise one for the messages of each group in `docs/howto/troubleshooting.md`;
`docs/reference/tools.md` and `docs/howto/missions-transcript.md` are written whole.
"""

import ast
import asyncio
import json
import re
import sys
from collections.abc import Collection, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from mcp_types import Tool

from fakes import FakeRobot, two_rooms
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.server.toolsets import build_toolsets
from mapspeak.session import Session
from missionscript import play_transcript

__all__ = ["main", "write_documents"]

ROOT = Path(__file__).parents[1]
REFERENCE = ROOT / "docs" / "reference" / "tools.md"
TRANSCRIPT = ROOT / "docs" / "howto" / "missions-transcript.md"
SNAPSHOT = ROOT / "tests" / "snapshots" / "tools.json"
WITH_TABLES = (ROOT / "README.md",)
TROUBLES = ROOT / "docs" / "howto" / "troubleshooting.md"
SOURCES = {
    "robot": ("links", "ros", "server/text/ros/outcomes.py"),
    "start": ("cli", "settings.py", "server/transport.py", "server/app.py"),
    "refused": ("safety", "places/goalcheck.py", "driving/drive.py", "driving/drivereport.py"),
    "files": (
        "spatial/mapfiles.py",
        "simulator/worlds/worldfiles.py",
        "cli/mapjobs.py",
        "cli/mapping.py",
    ),
}
"""Where the messages of each group are written, below src/mapspeak."""
ERRORS = {"ConfigError", "LinkError", "MapError", "GoalError", "PolicyError", "refuse", "Refusal"}
LEFT_OUT = "…"
LEAST_WORDS = 3
TABLE = re.compile(r"(?<=<!-- tools -->\n).*?(?=<!-- /tools -->)", re.DOTALL)


def main() -> None:
    """Write every document anew; with --check only say whether that would change one."""
    stale = [path for path, text in write_documents().items() if _read(path) != text]
    if "--check" in sys.argv:
        sys.exit(f"Out of date, run ./run docs: {', '.join(map(str, stale))}" if stale else 0)
    for path, text in write_documents().items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


FIELD = re.compile(r"\{(\w+)[^}]*\}")


def write_documents() -> dict[Path, str]:
    """Return the text of each generated document."""
    session = Session(FakeRobot(two_rooms()), SemanticMapStore(Path("unused.yaml")), lease_s=60.0)
    groups = build_toolsets(session)
    listed = asyncio.run(build_server(session, toolsets=groups).list_tools())
    by_name = {tool.name: tool for tool in listed}
    toolsets = {name: [by_name[tool.name] for tool in tools] for name, tools in groups.items()}
    documents = {path: TABLE.sub(_table(toolsets), _read(path)) for path in WITH_TABLES}
    documents[TROUBLES] = _read(TROUBLES)
    for group in SOURCES:
        between = re.compile(rf"(?<=<!-- {group} -->\n).*?(?=<!-- /{group} -->)", re.DOTALL)
        rows = "\n".join(
            f"| {said} | {hint} |" for said, hint in sorted(set(_messages(group, by_name)))
        )
        told = f"| message | what to do |\n|---|---|\n{rows}\n"
        documents[TROUBLES] = between.sub(lambda _, told=told: told, documents[TROUBLES])  # type: ignore[misc]
    documents[REFERENCE] = _reference(toolsets)
    documents[SNAPSHOT] = _snapshot(listed)
    documents[TRANSCRIPT] = asyncio.run(play_transcript())
    return documents


def _messages(group: str, tools: Collection[str]) -> Iterator[tuple[str, str]]:
    """Find the messages that source files raise, or keep as templates, each with its hint."""
    for place in SOURCES[group]:
        path = ROOT / "src" / "mapspeak" / place
        for file in [path] if path.is_file() else sorted(path.rglob("*.py")):
            tree = ast.parse(_read(file))
            texts = {
                target.id: node.value
                for node in tree.body
                if isinstance(node, ast.Assign)
                for target in node.targets
                if isinstance(target, ast.Name)
            }
            for node in ast.walk(tree):
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ERRORS:
                    told = _say_call(node, texts, tools)
                    if all(len(re.findall(r"[a-z]{2,}", text)) >= LEAST_WORDS for text in told):
                        yield told


def _say_call(
    call: ast.Call, texts: dict[str, ast.expr], tools: Collection[str]
) -> tuple[str, str]:
    """Return the message and the hint of an error that is made, or of the template of one."""
    said, hint = (*call.args, None, None)[:2]
    if getattr(call.func, "id", "") == "Refusal":
        fill = partial(FIELD.sub, lambda gap: gap[1] if gap[1] in tools else LEFT_OUT)
        return fill(_say(said, texts)), fill(_say(hint, texts))
    named = {each.arg: each.value for each in call.keywords}
    return _say(said, texts), _say(named.get("hint"), texts)


def _say(node: ast.expr | None, texts: dict[str, ast.expr]) -> str:
    """Return what an expression says; what only a run knows is left out."""
    if isinstance(node, ast.FormattedValue):
        node = node.value
    if isinstance(node, ast.Name):
        node = texts.get(node.id)
    match node:
        case ast.Call(func=ast.Name(id="lead"), args=[template], keywords=given):
            return _say_template(_say(template, texts), {each.arg for each in given})
        case ast.Constant(value=str(text)):
            return text.replace("|", "\\|").replace("<", "&lt;")
        case ast.JoinedStr(values=parts):
            return "".join(_say(part, texts) for part in parts)
        case ast.Call(func=ast.Name(id="shell_command"), args=[words]):
            return f"mapspeak {_say(words, texts)}"
        case ast.Call(func=ast.Name(id="say_install")):
            return "(the exact command)"
        case _:
            return LEFT_OUT


def _say_template(template: str, details: Collection[str | None]) -> str:
    """Return a template with the names of tools in it."""
    return FIELD.sub(lambda field: LEFT_OUT if field[1] in details else field[1], template)


def _table(toolsets: dict[str, list[Tool]]) -> str:
    homes = _find_homes(toolsets)
    lines = ["| tool | what it does | toolset |", "|---|---|---|"]
    lines += [
        f"| `{tool.name}` | {_first_sentence(tool)} | {', '.join(homes[tool.name])} |"
        for name, tools in toolsets.items()
        for tool in tools
        if homes[tool.name][0] == name
    ]
    return "\n".join(lines) + "\n"


def _reference(toolsets: dict[str, list[Tool]]) -> str:
    homes = _find_homes(toolsets)
    parts = ["# Tools\n\nGenerated from the code by `./run docs`."]
    for name, tools in toolsets.items():
        parts.append(f"## Toolset `{name}`")
        elsewhere = [f"`{tool.name}`" for tool in tools if homes[tool.name][0] != name]
        if elsewhere:
            parts.append(f"Described above: {', '.join(elsewhere)}.")
        parts += [_section(tool) for tool in tools if homes[tool.name][0] == name]
    return "\n\n".join(parts) + "\n"


def _find_homes(toolsets: dict[str, list[Tool]]) -> dict[str, list[str]]:
    """Return the toolsets of each tool; the first is where it is described."""
    homes: dict[str, list[str]] = {}
    for name, tools in toolsets.items():
        for tool in tools:
            homes.setdefault(tool.name, []).append(name)
    return homes


def _section(tool: Tool) -> str:
    lines = [f"### `{tool.name}`", "", tool.description or "", ""]
    required = tool.input_schema.get("required", [])
    for name, schema in tool.input_schema.get("properties", {}).items():
        need = "required" if name in required else "optional"
        lines.append(f"- `{name}` ({need}): {schema.get('description', '')}{_bounds(schema)}")
    return "\n".join(lines).rstrip()


def _bounds(schema: dict[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    return "" if low is None or high is None else f"; {low:g} to {high:g}"


def _first_sentence(tool: Tool) -> str:
    return re.split(r"(?<=\.)\s", tool.description or "", maxsplit=1)[0]


def _snapshot(listed: list[Tool]) -> str:
    tools = [tool.model_dump(mode="json", by_alias=True, exclude_none=True) for tool in listed]
    return json.dumps(tools, indent=1) + "\n"


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.exists() else ""


if __name__ == "__main__":
    main()
