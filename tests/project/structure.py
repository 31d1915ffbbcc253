"""What the tree of the source looks like to whoever reads it: names, circles, words."""

import ast
import json
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

CHECKOUT = Path(__file__).parents[2]
SOURCE = CHECKOUT / "src" / "mapspeak"
SPEAKING = frozenset({"cli", "evaluation", "server"})
"""Packages that may hold sentences for a reader."""
WORDS = frozenset(
    {
        *("advice", "explanation", "hint", "next_step", "reason", "reasons", "remark", "said"),
        *("saying", "sentence", "sentences", "why", "wording", "words"),
    }
)
"""Names of fields that hold text for a reader."""


def read_source() -> dict[Path, ast.Module]:
    """Return each module of the source, parsed, by its path below the package."""
    return {
        path.relative_to(SOURCE): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(SOURCE.rglob("*.py"))
    }


def find_doubled_classes(modules: dict[Path, ast.Module]) -> set[str]:
    """Return the names of public classes that stand in two modules or more."""
    homes: dict[str, set[Path]] = defaultdict(set)
    for path, module in modules.items():
        for node in module.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].add(path)
    return {name for name, paths in homes.items() if len(paths) > 1}


def find_circles(modules: dict[Path, ast.Module]) -> set[tuple[str, ...]]:
    """Return the groups of folders whose modules reach each other by their imports."""
    folders = {path.parent for path in modules}
    uses: dict[Path, set[Path]] = defaultdict(set)
    for path, module in modules.items():
        if path.name != "__init__.py":
            uses[path.parent] |= set(_imported_folders(module, folders)) - {path.parent, Path()}
    reached = {folder: _reach(folder, uses) for folder in folders - {Path()}}
    rings = (
        {other for other in others if folder in reached[other]}
        for folder, others in reached.items()
    )
    return {tuple(sorted(map(str, ring))) for ring in rings if len(ring) > 1}


def find_rings(modules: dict[Path, ast.Module]) -> set[tuple[str, ...]]:
    """Return the groups of modules that import each other while they are imported."""
    uses = {
        path: {
            found
            for node in module.body
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mapspeak")
            for alias in node.names
            if (found := _module_of(f"{node.module}.{alias.name}", modules))
        }
        for path, module in modules.items()
    }
    reached = {path: _reach(path, uses) for path in modules}
    rings = (
        {other for other in others if path in reached[other]} for path, others in reached.items()
    )
    return {tuple(sorted(map(str, ring))) for ring in rings if ring}


def _module_of(name: str, modules: dict[Path, ast.Module]) -> Path | None:
    """Return the file that an imported name comes from: a module, else what holds the name."""
    parts = name.split(".")[1:]
    for place in (parts, parts[:-1]):
        for path in (
            (Path(*place[:-1], f"{place[-1]}.py"), Path(*place, "__init__.py")) if place else ()
        ):
            if path in modules:
                return path
    return None


def find_texts_with_tools(modules: dict[Path, ast.Module]) -> dict[str, int]:
    """Return how many texts name a tool, in each module that must not know which there are."""
    tools = json.loads((CHECKOUT / "tests/snapshots/tools.json").read_text(encoding="utf-8"))
    naming = re.compile(rf"\b({'|'.join(_names_in(tools))})\b")
    counts = {
        str(path): sum(" " in text and bool(naming.search(text)) for text in _texts_of(module))
        for path, module in modules.items()
        if path.parts[0] not in SPEAKING
    }
    return {path: n for path, n in counts.items() if n}


def find_fields_with_words(modules: dict[Path, ast.Module]) -> set[str]:
    """Return the fields of values below the server that hold text for a reader."""
    return {
        f"{node.name}.{field.target.id}"
        for path, module in modules.items()
        if path.parts[0] not in SPEAKING and path.name != "errors.py"
        for node in ast.walk(module)
        if isinstance(node, ast.ClassDef)
        for field in node.body
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and field.target.id in WORDS
        and "str" in ast.unparse(field.annotation)
    }


def _imported_folders(module: ast.Module, folders: set[Path]) -> Iterator[Path]:
    for node in ast.walk(module):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mapspeak."):
            path = Path(*(node.module or "").split(".")[1:])
            home = path if path in folders else path.parent
            if home in folders:
                yield home


def _reach(folder: Path, uses: dict[Path, set[Path]]) -> set[Path]:
    found: set[Path] = set()
    waiting = [folder]
    while waiting:
        new = uses[waiting.pop()] - found
        found |= new
        waiting += new
    return found


def _names_in(tools: object) -> Iterator[str]:
    if isinstance(tools, dict):
        name = tools.get("name")
        if isinstance(name, str) and "_" in name:
            yield name
        for value in tools.values():
            yield from _names_in(value)
    elif isinstance(tools, list):
        for value in tools:
            yield from _names_in(value)


def _texts_of(module: ast.Module) -> Iterator[str]:
    """Return each text but docstrings; one with values in it as a whole."""
    inner = {
        id(part)
        for node in ast.walk(module)
        if isinstance(node, ast.JoinedStr)
        for part in ast.walk(node)
        if part is not node
    }
    inner |= {id(node.value) for node in ast.walk(module) if isinstance(node, ast.Expr)}
    for node in ast.walk(module):
        if id(node) in inner:
            continue
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield "".join(
                str(part.value) if isinstance(part, ast.Constant) else "X" for part in node.values
            )
