"""YAML text as plain data that knows where in the text it stands.

Scalars stay text: whether `101` is a room's name or a number, the schema knows and YAML does not.
Aliases are refused, so that a few lines cannot unfold into gigabytes.
"""

import re
from collections.abc import Iterator
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import CollectionNode, MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError
from ruamel.yaml.tokens import ScalarToken

from mapspeak.errors import SemanticMapError
from mapspeak.memory.quoting import quote_name

Data = str | None | list["Data"] | dict[str, "Data"]
"""Content of a node without its position: text, nothing, a list or a mapping."""

Path = tuple[int | str, ...]
"""The keys and the numbers of items that lead to a part of some data."""

MAX_DEPTH = 20
_NULLS = frozenset({"", "~", "null", "Null", "NULL"})
_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_COMMENT = re.compile(r"(?:(?<=\s)|^)#[^\n]*")


class Bare(str):
    """Text that stands in the file without quotes: a number, a time, a truth value, a name."""

    __slots__ = ()


class TextFaultError(SemanticMapError):
    """A fault at one place of the text; lines and columns are counted from 1.

    Attributes:
        other_line: Line that it conflicts with, if any.
    """

    def __init__(
        self, message: str, *, hint: str, line: int, column: int = 1, other_line: int | None = None
    ) -> None:
        super().__init__(message, hint=hint)
        self.line = line
        self.column = column
        self.other_line = other_line

    def moved(self, n_lines: int) -> "TextFaultError":
        """Return the same fault, moved down by a number of lines."""
        return TextFaultError(
            self.message,
            hint=self.hint,
            line=self.line + n_lines,
            column=self.column,
            other_line=None if self.other_line is None else self.other_line + n_lines,
        )


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    """Return where an offset lies, both counted from 1."""
    breaks = list(_BREAK.finditer(text, 0, offset))
    line_start = breaks[-1].end() if breaks else 0
    return len(breaks) + 1, offset - line_start + 1


def compose(text: str) -> Node | None:
    """Read one YAML document; None when it holds nothing but comments.

    Raises:
        TextFaultError: It is not YAML, or uses a part of YAML that a semantic map has no need of.
    """
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer = _Composer
    try:
        node: Node | None = yaml.compose(text)
    except MarkedYAMLError as error:
        raise _syntax_fault(text, error) from error
    except ReaderError as error:
        problem = f"the character U+{error.character:04X} is not allowed"
        raise _not_yaml(text, problem, error.position) from error
    except (YAMLError, ValueError, ArithmeticError, LookupError, AssertionError) as error:
        # The parser does not wrap all its own errors, such as a \U escape beyond Unicode.
        raise _not_yaml(text, str(error), 0) from error
    return node


class _Composer(Composer):
    """Composes nodes without aliases, and no deeper than a memory needs."""

    _depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:  # noqa: ANN401 - as ruamel has it
        event = self.parser.peek_event()
        if isinstance(event, AliasEvent):
            raise _fault_at(
                event,
                f"A semantic map has no aliases, and *{event.anchor} is one.",
                hint="Write the value itself in this place.",
            )
        if self._depth > MAX_DEPTH:
            raise _fault_at(
                event,
                f"Lists and mappings are nested more than {MAX_DEPTH} deep.",
                hint="A waypoint needs three levels; take the rest out.",
            )
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _fault_at(place: Any, message: str, *, hint: str) -> TextFaultError:  # noqa: ANN401 - a node or an event
    mark = place.start_mark
    return TextFaultError(message, hint=hint, line=mark.line + 1, column=mark.column + 1)


def _syntax_fault(text: str, error: MarkedYAMLError) -> TextFaultError:
    problem = str(error.problem or error.context)
    if "single document" in str(error.context):
        line, column = line_and_column(text, error.problem_mark.index)
        return TextFaultError(
            "A second YAML document begins here.",
            hint="Keep one document in the file: take out the line '---' or '...'.",
            line=line,
            column=column,
        )
    is_unclosed = "end of stream" in problem
    marks = (error.context_mark if is_unclosed else None, error.problem_mark, error.context_mark)
    return _not_yaml(text, problem, next((m.index for m in marks if m is not None), 0))


def _not_yaml(text: str, problem: str, offset: int) -> TextFaultError:
    if text[offset : offset + 1] == "\t":
        problem = "a tab stands where only spaces can"
    line, column = line_and_column(text, offset)
    return TextFaultError(
        f"This is not YAML: {problem}.",
        hint="Indent with spaces alone, close what is open, and put text with a colon in quotes.",
        line=line,
        column=column,
    )


# --- what nodes say --------------------------------------------------------------------------


def data_of(node: Node | None) -> Data:
    """Return the content of a node.

    Raises:
        TextFaultError: A key is not a word, or occurs twice in one mapping.
    """
    if isinstance(node, MappingNode):
        return {key: data_of(value) for key, value in entries_of(node)}
    if isinstance(node, SequenceNode):
        return [data_of(item) for item in node.value]
    if not isinstance(node, ScalarNode) or (node.style is None and node.value in _NULLS):
        return None
    return Bare(node.value) if node.style is None else str(node.value)


def entries_of(node: MappingNode) -> Iterator[tuple[str, Node]]:
    """Return the keys and values of a mapping.

    Raises:
        TextFaultError: As for `data_of`.
    """
    lines: dict[str, int] = {}
    for key, value in node.value:
        if not isinstance(key, ScalarNode):
            raise _fault_at(key, "A key is a list or a mapping.", hint="Use a word.")
        if key.value in lines:
            fault = _fault_at(
                key,
                f"The key {quote_name(key.value)} stands here twice.",
                hint="Keep one of the two.",
            )
            fault.other_line = lines[key.value]
            raise fault
        lines[key.value] = key.start_mark.line + 1
        yield key.value, value


def locate(node: Node | None, path: Path) -> tuple[int, int]:
    """Return the line and the column of a part, or of the last thing on the way that is there."""
    key_behind: Node | None = None
    for step in path:
        items = node.value if isinstance(node, CollectionNode) else []
        found: tuple[Node | None, Node | None] = (None, None)
        if isinstance(node, MappingNode):
            found = next((each for each in items if each[0].value == step), found)
        elif isinstance(step, int) and step < len(items):
            found = (None, items[step])
        if found[1] is None:
            break
        key_behind, node = found
    if node is None:
        return 1, 1
    if key_behind is not None and node.start_mark.index == node.end_mark.index:
        # What is absent stands for the parser where the next thing begins.
        return key_behind.end_mark.line + 1, key_behind.end_mark.column + 2
    return node.start_mark.line + 1, node.start_mark.column + 1


def find_comments(text: str) -> list[str]:
    """Return the comments in a text, in their order; what a value says is none."""
    characters = list(text)
    for token in YAML(typ="safe", pure=True).scan(text):
        if isinstance(token, ScalarToken):
            start, end = token.start_mark.index, token.end_mark.index
            # The first line of a text below its key may end with a comment.
            start = text.index("\n", start) if token.style in ("|", ">") else start
            characters[start:end] = " " * (end - start)
    return _COMMENT.findall("".join(characters))
