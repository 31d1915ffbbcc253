"""People's comments: where they stand in a text, which the YAML tree does not say."""

import re
from collections.abc import Iterator, Sequence

from mapspeak.semantic.mapfile.tree import ListNode, MappingNode, Node, ScalarNode

_COMMENT = re.compile(r"(?:(?<=\s)|^)#[^\n]*")


def comments_within(text: str, node: Node) -> list[str]:
    """Gives the comments between the first and the last character of a node."""
    if isinstance(node, ScalarNode):
        header = text[node.start : node.end].partition("\n")[0]
        return _COMMENT.findall(header) if header[:1] in ("|", ">") else []
    return comments_in(text, node.start, node.end, list(_children(node)))


def comments_in(text: str, start: int, end: int, nodes: Sequence[Node]) -> list[str]:
    """Gives the comments in a stretch of text, those within its nodes included."""
    inner = [comment for node in nodes for comment in comments_within(text, node)]
    return comments_between(text, start, end, nodes) + inner


def comments_between(text: str, start: int, end: int, nodes: Sequence[Node]) -> list[str]:
    """Gives the comments in a stretch of text that stand before, between and behind its nodes."""
    starts = [start, *(node.end for node in nodes)]
    ends = [*(node.start for node in nodes), end]
    gaps = (text[a:b] for a, b in zip(starts, ends, strict=True))
    return [comment for gap in gaps for comment in _COMMENT.findall(gap)]


def without_comments(gap: str) -> str:
    """Gives what stands between two nodes with every comment turned into spaces."""
    return _COMMENT.sub(lambda match: " " * len(match[0]), gap)


def _children(node: ListNode | MappingNode) -> Iterator[Node]:
    if isinstance(node, ListNode):
        yield from node.items
        return
    for key, value in node.entries:
        yield key
        yield value
