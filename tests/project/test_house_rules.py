"""What we promised each other about the files, where no linter checks it."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

CHECKOUT = Path(__file__).parents[2]
SOURCE = CHECKOUT / "src" / "mapspeak"
FOLDERS = ("src", "tests", "benchmarks", "docs", "tools", ".ci")
TEXT_SUFFIXES = {"", ".cfg", ".in", ".json", ".md", ".py", ".toml", ".txt", ".yaml", ".yml"}

MOST_LINES_OF_A_FILE = 400
MOST_LINES_OF_A_FUNCTION = 50
NAMES_WITHOUT_A_CONCEPT = {"base", "common", "helpers", "misc", "utils"}

UNFINISHED = re.compile(r"\b(?:TO" r"DO|FIX" r"ME|XX" r"X)\b")
PATH_OF_A_MACHINE = re.compile(r"(?<![\w.~])/(?:root|work|Users|home/(?!you\b|user\b)\w)")


def own_texts() -> Iterator[Path]:
    """Finds the project's text files, in the order of their names."""
    files = [path for folder in FOLDERS for path in (CHECKOUT / folder).rglob("*")]
    # In a work tree of its own, ".git" is a file, and git's.
    files += (path for path in CHECKOUT.glob("*") if path.name != ".git")
    for path in sorted(files):
        if path.is_file() and path.suffix in TEXT_SUFFIXES and "__pycache__" not in path.parts:
            yield path


def lines_matching(pattern: re.Pattern[str]) -> list[str]:
    return [
        f"{path.relative_to(CHECKOUT)}:{number}: {line.strip()}"
        for path in own_texts()
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if pattern.search(line)
    ]


def sources() -> dict[str, Path]:
    return {str(path.relative_to(SOURCE)): path for path in sorted(SOURCE.rglob("*.py"))}


def functions_of(path: Path) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def n_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    return (node.end_lineno or node.lineno) - node.lineno + 1


def test_a_file_fits_in_four_hundred_lines() -> None:
    lengths = {name: len(path.read_text().splitlines()) for name, path in sources().items()}
    assert [name for name, length in lengths.items() if length > MOST_LINES_OF_A_FILE] == []


def test_a_function_fits_in_fifty_lines() -> None:
    assert [
        f"{name}: {function.name}"
        for name, path in sources().items()
        for function in functions_of(path)
        if n_lines(function) > MOST_LINES_OF_A_FUNCTION
    ] == []


def test_a_package_lists_its_names_and_does_nothing_else() -> None:
    allowed = (ast.Import, ast.ImportFrom, ast.Assign)
    packages = {name: path for name, path in sources().items() if path.name == "__init__.py"}
    assert [
        f"{name}: {ast.unparse(node).splitlines()[0]}"
        for name, path in packages.items()
        for node in ast.parse(path.read_text()).body[1:]
        if not isinstance(node, allowed)
    ] == []


def test_every_module_has_a_concept_for_a_name() -> None:
    names = {part for name in sources() for part in Path(name).with_suffix("").parts}
    assert names & NAMES_WITHOUT_A_CONCEPT == set()


def test_nothing_is_left_for_later() -> None:
    assert lines_matching(UNFINISHED) == []


def test_no_file_knows_the_machine_it_was_written_on() -> None:
    assert lines_matching(PATH_OF_A_MACHINE) == []
