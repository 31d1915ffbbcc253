"""`python -m tools.faults PACKAGE` seeds faults in one package and tells which the tests miss.

PACKAGE is a folder of `src/mapspeak`, such as `safety`. A fault is one small change of one
expression: a bound (`<` for `<=`), a sign, a factor for a divisor, `and` for `or`, a unit that is
not converted, a call that is not awaited, a number that is doubled. Places are chosen by a seed
among all expressions in functions. For each fault those of the package's own tests run that reach
its line; a fault that none reaches is missed. The checkout is not changed: a copy of `src` is.

Needs the library pytest-cov beside the environment that `./run` makes.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click

ROOT = Path(__file__).parent.parent
MOST_TESTS = 60
"""Run for one fault: of more tests every second, third, ... is enough."""
TIMEOUT_S = 300.0
TESTS_FAILED = 1
"""The exit code of pytest for that."""
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
BOUNDS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}
UNITS = {"radians", "degrees", "deg2rad", "rad2deg"}


@dataclass(frozen=True)
class Fault:
    """One expression, as it is and as it is made.

    Attributes:
        kind: What is wrong then: a bound, a sign, ...
        span: The characters of the file that are replaced.
    """

    path: Path
    line: int
    kind: str
    span: tuple[int, int]
    now: str
    made: str

    def spoil(self, source: str) -> str:
        """Return the text of the file with the fault in it."""
        start, end = self.span
        return source[:start] + self.made + source[end:]

    def __str__(self) -> str:
        """Tell where it is and what it does, in one line."""
        now, made = (" ".join(each.split()) for each in (self.now, self.made))
        return f"{self.path}:{self.line}: {self.kind}: {now}  ->  {made}"


def find_faults(path: Path) -> Iterator[Fault]:
    """Yield every fault that could be seeded in the functions of a file."""
    source = (ROOT / path).read_text(encoding="utf-8")
    offsets = [0]
    for line in source.splitlines(keepends=True):
        offsets.append(offsets[-1] + len(line))
    lines = source.splitlines(keepends=True)

    def find_place(line: int, column: int) -> int:
        return offsets[line - 1] + len(lines[line - 1].encode()[:column].decode())

    tree = ast.parse(source)
    functions = (each for each in ast.walk(tree) if isinstance(each, FUNCTIONS))
    # The faults of a nested function are also those of the one around it.
    nodes = (node for each in functions for part in each.body for node in ast.walk(part))
    for node in dict.fromkeys(nodes):
        for kind, made in _spoil(node):
            ends = (node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]
            span = (find_place(node.lineno, node.col_offset), find_place(*ends))  # type: ignore[attr-defined]
            now = source[slice(*span)]
            yield Fault(path, node.lineno, kind, span, now, made)  # type: ignore[attr-defined]


def _spoil(node: ast.AST) -> Iterator[tuple[str, str]]:
    match node:
        case ast.Compare(left=left, ops=[operator], comparators=[right]):
            other = ast.Compare(left, [BOUNDS[type(operator)]()], [right])
            yield "bound", f"({ast.unparse(other)})"
        case ast.BinOp(left=left, op=operator, right=right) if (
            type(operator) in OPERATORS and not _is_text(left) and not _is_text(right)
        ):
            other_sum = ast.BinOp(left, OPERATORS[type(operator)](), right)
            yield "sign or factor", f"({ast.unparse(other_sum)})"
        case ast.BoolOp(op=operator, values=values):
            made = ast.Or() if isinstance(operator, ast.And) else ast.And()
            yield "and for or", f"({ast.unparse(ast.BoolOp(made, values))})"
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield "sign", f"({ast.unparse(operand)})"
        case ast.Call(func=ast.Attribute(attr=name) | ast.Name(id=name), args=[only]) if (
            name in UNITS
        ):
            yield "unit", f"({ast.unparse(only)})"
        case ast.Expr(value=ast.Await(value=ast.Call())):
            yield "dropped await", "pass"
        case ast.Constant(value=float() as number) if number:
            yield "number", repr(2 * number)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
    )


def map_tests(package: str, folder: Path, tests: list[str]) -> dict[str, dict[int, list[str]]]:
    """Return which tests reach which line of which file of a package."""
    os.environ["COVERAGE_FILE"] = str(folder / "coverage")
    counting = [f"--cov=mapspeak.{package}", "--cov-context=test", "--cov-report="]
    ran = _run_tests([*tests, "-n2", *counting], ROOT / "src", timeout_s=3600.0)
    if ran.returncode:
        sys.exit(f"The tests fail without any fault:\n{ran.stdout[-3000:]}")
    report = folder / "coverage.json"
    options = ["--show-contexts", "-q", "-o", str(report)]
    command = [sys.executable, "-m", "coverage", "json", *options]
    subprocess.run(command, check=True, cwd=ROOT)  # noqa: S603 - our own program
    files = json.loads(report.read_text())["files"]
    return {
        path: {
            # "|" may stand in the id of a parameter as well as before "setup", "run" or "teardown".
            int(line): sorted({each.rpartition("|")[0] for each in contexts if each})
            for line, contexts in told["contexts"].items()
        }
        for path, told in files.items()
    }


def _run_tests(
    options: list[str], source: Path, *, timeout_s: float = TIMEOUT_S
) -> subprocess.CompletedProcess[str]:
    # `sys.path` has what PYTHONPATH names before the checkout that is installed.
    return subprocess.run(  # noqa: S603 - our own tests
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


def is_caught(fault: Fault, source: Path, tests: list[str]) -> bool:
    """Tell whether a test fails, or never ends, with a fault in a copy of the source."""
    file = source / fault.path.relative_to("src")
    before = file.read_text(encoding="utf-8")
    file.write_text(fault.spoil(before), encoding="utf-8")
    try:
        code = _run_tests(["-x", *tests], source).returncode
    except subprocess.TimeoutExpired:
        return True
    finally:
        file.write_text(before, encoding="utf-8")
    if code > TESTS_FAILED and _run_tests(["--collect-only", *tests], source).returncode:
        sys.exit(f"These tests cannot be collected: {tests}")
    # What fails as a test's module is imported has another code.
    return code != 0


def main() -> None:
    """Seed faults in the package that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tools.faults", description=__doc__)
    parser.add_argument("package", help="a folder of src/mapspeak, such as safety")
    parser.add_argument("--tests", nargs="*", help="default: tests/PACKAGE")
    parser.add_argument("--faults", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    tests = asked.tests or [f"tests/{asked.package}"]
    root = Path("src/mapspeak", asked.package)
    files = sorted(path.relative_to(ROOT) for path in (ROOT / root).rglob("*.py"))
    faults = [fault for path in files for fault in find_faults(path)]
    chosen = random.Random(asked.seed).sample(  # noqa: S311 - chance, not a secret
        faults, min(asked.faults, len(faults))
    )
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        reached = map_tests(asked.package.replace("/", "."), folder, tests)
        source = folder / "src"
        shutil.copytree(ROOT / "src", source)
        missed = 0
        for fault in sorted(chosen, key=lambda each: (str(each.path), each.line)):
            reached_by = reached.get(str(fault.path), {}).get(fault.line, [])
            some = reached_by[:: len(reached_by) // MOST_TESTS + 1]
            if not some or not is_caught(fault, source, some):
                missed += 1
                click.echo(f"missed ({len(reached_by)} tests reach it): {fault}")
    click.echo(
        f"{asked.package}: {len(chosen) - missed} of {len(chosen)} faults caught, seed {asked.seed}"
    )


if __name__ == "__main__":
    main()
