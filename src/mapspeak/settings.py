"""Files of settings that people write, as YAML: read strictly, each fault named with its line."""

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from mapspeak.errors import ConfigError, say_cause

MAX_FILE_BYTES = 1_000_000

PLAIN = {
    "too_short": "it needs at least {min_length} parts, and has {actual_length}",
    "too_long": "it may have {max_length} parts, and has {actual_length}",
    "string_too_short": "it is empty",
    "string_too_long": "it is longer than {max_length} characters",
    "string_pattern_mismatch": "it is not of the form it has to have",
}
"""What is wrong with a value, by what pydantic calls it."""

Settings = TypeVar("Settings", bound=BaseModel)
Location = tuple[int | str, ...]


def read_settings(
    path: Path,
    model: type[Settings],
    *,
    name: str,
    advice: str,
    context: Mapping[str, Any] | None = None,
) -> Settings:
    """Read a file into a model; an empty file takes every default.

    Args:
        model: What may stand in it, all of it with a default.
        name: What people call such a file, as in "robot.yaml".
        advice: What to do about a value that cannot be.
        context: What the model's validators need to know besides, such as the file's folder.

    Raises:
        ConfigError: The file cannot be read, or has a mistake; says the line and the key.
    """
    tree = _load(path, name)
    if tree is None:
        return model()
    if not isinstance(tree, CommentedMap):
        raise ConfigError(
            f"{path}, line 1: this is not a list of keys and values.",
            hint=f"Write lines like `{next(iter(model.model_fields))}: ...`.",
        )
    try:
        return model.model_validate(tree, context=context)
    except ValidationError as error:
        raise _fault_in(path, tree, error, model=model, name=name, advice=advice) from error


def _load(path: Path, name: str) -> Any:  # noqa: ANN401 - whatever a person wrote
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise ConfigError(
                f"{path} is larger than {MAX_FILE_BYTES:,} bytes.",
                hint=f"Give a {name}, not a recording or a map.",
            )
        return YAML(typ="rt").load(path.read_text(encoding="utf-8"))
    except MarkedYAMLError as error:
        mark = error.problem_mark
        line = f", line {mark.line + 1}" if mark is not None else ""
        raise ConfigError(
            f"{path}{line} is no YAML: {error.problem}.", hint="Write `key: value` on each line."
        ) from error
    except (OSError, UnicodeDecodeError, YAMLError, RecursionError, ValueError) as error:
        raise ConfigError(
            f"{path} cannot be read: {say_cause(error)}.",
            hint="Check the path, and that it is a text file.",
        ) from error


def _fault_in(
    path: Path,
    tree: CommentedMap,
    error: ValidationError,
    *,
    model: type[BaseModel],
    name: str,
    advice: str,
) -> ConfigError:
    first, *others = error.errors()
    location = first["loc"]
    key = ".".join(str(part) for part in location)
    more = f" {len(others)} more mistakes follow." if others else ""
    if first["type"] == "extra_forbidden":
        known = _keys_beside(model, location)
        near = difflib.get_close_matches(str(location[-1]), known, n=1)
        what = f"'{key}' is not a key of {name}."
        hint = f"Did you mean `{near[0]}`?" if near else f"Here belong: {', '.join(known)}."
    else:
        what = f"'{key or name}' cannot be {str(first['input'])[:80]!r}: {_say_fault(first)}."
        hint = advice
    return ConfigError(f"{path}, line {_line_of(tree, location)}: {what}{more}", hint=hint)


def _say_fault(fault: ErrorDetails) -> str:
    """Return what is wrong with a value; the library speaks to programmers of some of it."""
    told = PLAIN.get(fault["type"])
    return (
        told.format(**fault["ctx"]) if told else fault["msg"].replace("Input should", "it should")
    )


def _keys_beside(model: Any, location: Location) -> list[str]:  # noqa: ANN401 - see below
    """Return the keys that a place of the file may have; models lie within models and lists."""
    for part in location[:-1]:
        if isinstance(part, int):
            continue
        annotation: Any = model.model_fields[part].annotation
        model = getattr(annotation, "__args__", (annotation,))[0]
    return [each.alias or name for name, each in model.model_fields.items()]


def _line_of(tree: CommentedMap, location: Location) -> int:
    """Return the line of the innermost part of a place that the file has, from 1."""
    node: Any = tree
    line = 0
    for part in location:
        places = node.lc.data if isinstance(node, CommentedMap | CommentedSeq) else None
        if not places or (part not in places):
            break
        line = int(places[part][0])
        node = node[part]
    return line + 1
