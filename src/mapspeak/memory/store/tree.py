"""YAML text as a tree whose every node knows where in the text it stands.

Scalars stay text: whether `101` is a room's name or a number, the schema knows and YAML does not.
Aliases are refused, so that a few lines cannot unfold into gigabytes.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    Event,
    MappingStartEvent,
    ScalarEvent,
)
from ruamel.yaml.reader import ReaderError

from mapspeak.errors import SemanticMapError
from mapspeak.memory.quoting import quote_name

Data = str | None | list["Data"] | dict[str, "Data"]
"""What a node says, without its place: text, nothing, a list or a mapping."""

MAX_DEPTH = 20
_NULLS = frozenset({"", "~", "null", "Null", "NULL"})
_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")


class TextError(SemanticMapError):
    """The text is wrong at one place.

    Attributes:
        other_offset: Of the place it clashes with, if any.
    """

    def __init__(
        self, message: str, *, hint: str, offset: int, other_offset: int | None = None
    ) -> None:
        super().__init__(message, hint=hint)
        self.offset = offset
        self.other_offset = other_offset

    def moved(self, place: Callable[[int], int]) -> "TextError":
        """Return the same fault where the text is a part of a longer one."""
        other = None if self.other_offset is None else place(self.other_offset)
        return TextError(
            self.message, hint=self.hint, offset=place(self.offset), other_offset=other
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ScalarNode:
    """One piece of text, as it reads once quotes and folds are undone.

    Attributes:
        is_plain: It stands without quotes.
        start: Offset of its first character, the quote included.
    """

    text: str
    is_plain: bool
    start: int
    end: int

    @property
    def data(self) -> str | None:
        """What it says; None for an unquoted null or nothing at all."""
        return None if self.is_plain and self.text in _NULLS else self.text


@dataclass(frozen=True, slots=True, kw_only=True)
class ListNode:
    """A list, in brackets (`is_flow`) or with one dash a line."""

    items: tuple["Node", ...]
    is_flow: bool
    start: int
    end: int

    @property
    def data(self) -> list[Data]:
        """What its items say."""
        return [item.data for item in self.items]


@dataclass(frozen=True, slots=True, kw_only=True)
class MappingNode:
    """Keys with their values, in braces (`is_flow`) or one a line."""

    entries: tuple[tuple[ScalarNode, "Node"], ...]
    is_flow: bool
    start: int
    end: int

    @property
    def data(self) -> dict[str, Data]:
        """What its values say, by key."""
        return {key.text: value.data for key, value in self.entries}

    def find_value(self, key: str) -> "Node | None":
        """Return the node under a key."""
        return next((value for name, value in self.entries if name.text == key), None)


Node = ScalarNode | ListNode | MappingNode


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    """Return where an offset lies, both counted from 1."""
    breaks = list(_BREAK.finditer(text, 0, offset))
    line_start = breaks[-1].end() if breaks else 0
    return len(breaks) + 1, offset - line_start + 1


def parse_tree(text: str) -> Node | None:
    """Read one YAML document; None when it holds nothing but comments.

    Raises:
        TextError: It is not YAML, or uses a part of YAML that a semantic map has no need of.
    """
    builder = _Builder(text)
    for event in _events(text):
        builder.add(event)
    return builder.root


def _events(text: str) -> Iterator[Event]:
    offset = 0
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            offset = event.end_mark.index
            yield event
    except MarkedYAMLError as error:
        is_unclosed = "end of stream" in str(error.problem)
        marks = (
            error.context_mark if is_unclosed else None,
            error.problem_mark,
            error.context_mark,
        )
        place = next((mark.index for mark in marks if mark is not None), offset)
        raise _syntax_fault(text, error.problem or error.context, place) from error
    except ReaderError as error:
        problem = f"the character U+{error.character:04X} is not allowed"
        raise _syntax_fault(text, problem, error.position) from error
    except (YAMLError, ValueError, ArithmeticError, LookupError, AssertionError) as error:
        # The parser lets some of its own slips through, such as a \U escape beyond Unicode.
        raise _syntax_fault(text, str(error), offset) from error


def _syntax_fault(text: str, problem: str, offset: int) -> TextError:
    if text[offset : offset + 1] == "\t":
        problem = "a tab stands where only spaces can"
    return TextError(
        f"This is not YAML: {problem}.",
        hint="Indent with spaces alone, close what is open, and put text with a colon in quotes.",
        offset=offset,
    )


@dataclass(slots=True)
class _Frame:
    """A list or mapping whose end has not been read yet."""

    start_event: CollectionStartEvent
    children: list[Node] = field(default_factory=list)


class _Builder:
    """Puts the parser's events together without recursion."""

    def __init__(self, text: str) -> None:
        self.root: Node | None = None
        self._text = text
        self._open: list[_Frame] = []

    def add(self, event: Event) -> None:
        match event:
            case AliasEvent():
                raise TextError(
                    f"A semantic map has no aliases, and *{event.anchor} is one.",
                    hint="Write the value itself in this place.",
                    offset=event.start_mark.index,
                )
            case ScalarEvent():
                self._close(self._scalar(event))
            case CollectionStartEvent():
                self._start(event)
            case CollectionEndEvent():
                self._close(self._collection(self._open.pop(), event))
            case _:
                pass

    def _start(self, event: CollectionStartEvent) -> None:
        if len(self._open) >= MAX_DEPTH:
            raise TextError(
                f"Lists and mappings are nested more than {MAX_DEPTH} deep.",
                hint="A waypoint needs three levels; take the rest out.",
                offset=event.start_mark.index,
            )
        self._open.append(_Frame(event))

    def _scalar(self, event: ScalarEvent) -> ScalarNode:
        start, end = event.start_mark.index, event.end_mark.index
        if event.style in ("|", ">"):
            end = start + len(self._text[start:end].rstrip())
        return ScalarNode(text=event.value, is_plain=event.style is None, start=start, end=end)

    def _collection(self, frame: _Frame, end_event: CollectionEndEvent) -> Node:
        start = frame.start_event.start_mark.index
        is_flow = bool(frame.start_event.flow_style)
        # A block ends for the parser where the next thing begins; for us, with its last child.
        end = end_event.end_mark.index
        if isinstance(frame.start_event, MappingStartEvent):
            entries = tuple(self._entries(frame.children))
            end = end if is_flow or not entries else entries[-1][1].end
            return MappingNode(entries=entries, is_flow=is_flow, start=start, end=end)
        end = end if is_flow or not frame.children else frame.children[-1].end
        return ListNode(items=tuple(frame.children), is_flow=is_flow, start=start, end=end)

    def _entries(self, children: list[Node]) -> Iterator[tuple[ScalarNode, Node]]:
        seen: dict[str, ScalarNode] = {}
        for key, value in zip(children[::2], children[1::2], strict=True):
            if not isinstance(key, ScalarNode):
                message = "A key is a list or a mapping."
                raise TextError(message, hint="Use a word.", offset=key.start)
            if key.text in seen:
                raise TextError(
                    f"The key {quote_name(key.text)} stands here twice.",
                    hint="Keep one of the two.",
                    offset=key.start,
                    other_offset=seen[key.text].start,
                )
            seen[key.text] = key
            yield key, self._behind_colon(key, value)

    def _behind_colon(self, key: ScalarNode, value: Node) -> Node:
        """Move an absent value from where the next thing begins to its key's colon."""
        if not isinstance(value, ScalarNode) or value.start != value.end:
            return value
        colon = self._text.find(":", key.end, value.start)
        place = key.end if colon < 0 else colon + 1
        return ScalarNode(text="", is_plain=True, start=place, end=place)

    def _close(self, node: Node) -> None:
        if self._open:
            self._open[-1].children.append(node)
        elif self.root is None:
            self.root = node
        else:
            raise TextError(
                "A second YAML document begins here.",
                hint="Keep one document in the file: take out the line '---' or '...'.",
                offset=node.start,
            )


_COMMENT = re.compile(r"(?:(?<=\s)|^)#[^\n]*")


def comments_within(text: str, node: Node) -> list[str]:
    """Return the comments between the first and the last character of a node."""
    if isinstance(node, ScalarNode):
        header = text[node.start : node.end].partition("\n")[0]
        return _COMMENT.findall(header) if header[:1] in ("|", ">") else []
    return comments_in(text, node.start, node.end, list(_children(node)))


def comments_in(text: str, start: int, end: int, nodes: Sequence[Node]) -> list[str]:
    """Return the comments in a stretch of text, those within its nodes included."""
    inner = [comment for node in nodes for comment in comments_within(text, node)]
    return comments_between(text, start, end, nodes) + inner


def comments_between(text: str, start: int, end: int, nodes: Sequence[Node]) -> list[str]:
    """Return the comments in a stretch of text that stand before, between and behind its nodes."""
    starts = [start, *(node.end for node in nodes)]
    ends = [*(node.start for node in nodes), end]
    gaps = (text[a:b] for a, b in zip(starts, ends, strict=True))
    return [comment for gap in gaps for comment in _COMMENT.findall(gap)]


def without_comments(gap: str) -> str:
    """Return what stands between two nodes with every comment turned into spaces."""
    return _COMMENT.sub(lambda match: " " * len(match[0]), gap)


def _children(node: ListNode | MappingNode) -> Iterator[Node]:
    if isinstance(node, ListNode):
        yield from node.items
        return
    for key, value in node.entries:
        yield key
        yield value
