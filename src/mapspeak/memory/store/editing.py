"""Edit one record in its own text: unchanged parts keep their lines, all comments stay."""

from collections.abc import Iterator

from ruamel.yaml.nodes import MappingNode, Node, SequenceNode

from mapspeak.memory.store.cutting import split_end
from mapspeak.memory.store.yamltext import Data, compose, data_of, find_comments
from mapspeak.memory.store.yamlwriting import entry_text, flow_text, line_text


def edited_item(text: str, *, indent: int, old: dict[str, Data], new: dict[str, Data]) -> str:
    """Return the text of one item of a list, changed from one content to another.

    A changed key or list item within it is rewritten, with the comments behind it. People's own
    keys stay.
    """
    body, rest = split_end(text, indent)
    listed = compose(body)
    node = listed.value[0] if isinstance(listed, SequenceNode) else None
    if not isinstance(node, MappingNode):
        return text
    if not node.flow_style:
        return "".join(_edited_lines(body, node, old, new)) + rest
    line = flow_text(merged_data(data_of(node), old, new))
    comments = find_comments(body)
    return " " * indent + "  ".join([f"- {line}", *comments]) + "\n" + rest


def _edited_lines(
    text: str, node: MappingNode, old: dict[str, Data], new: dict[str, Data]
) -> Iterator[str]:
    """Return the stretches of an item's text, one for each key."""
    text = text if text.endswith("\n") else text + "\n"
    column = node.start_mark.column
    starts = [0, *(_line_start(text, key) for key, _ in node.value[1:]), len(text)]
    said = data_of(node)
    assert isinstance(said, dict)  # noqa: S101 - a mapping says one
    for (key, value), start, end in zip(node.value, starts[:-1], starts[1:], strict=True):
        name = key.value
        if new.get(name) == old.get(name):
            yield text[start:end]
            continue
        edited = _edited_list(text, value, end, old.get(name), new.get(name))
        if edited is not None:
            yield text[start : _line_start(text, value.value[0])] + edited
            continue
        stretch, below = split_end(text[start:end], column)
        found = find_comments(stretch)
        merged = merged_data(said[name], old.get(name), new.get(name))
        yield text[start : key.start_mark.index]
        yield entry_text(name, merged, indent=column, comments="  ".join(found)) + "\n" + below
    for name, data in new.items():
        if name not in said and data:
            yield " " * column + entry_text(name, data, indent=column) + "\n"


def _edited_list(text: str, node: Node, end: int, old: Data, new: Data) -> str | None:
    """Return the lines of a list with a dash a line; None where it is not laid out so."""
    is_listed = isinstance(node, SequenceNode) and not node.flow_style and node.value
    if not is_listed or not isinstance(new, list) or not isinstance(old, list) or not new:
        return None
    if len(old) != len(node.value):
        return None
    starts = [_line_start(text, item) for item in node.value]
    if any(
        text[start : item.start_mark.index].strip() != "-"
        for start, item in zip(starts, node.value, strict=True)
    ):
        return None
    margin = text[starts[0] : node.value[0].start_mark.index].partition("-")[0]
    spans = list(zip(starts, [*starts[1:], end], strict=True))
    sources, gone = _find_sources(old, new)
    lines = []
    for item, source in zip(new, sources, strict=True):
        if source is not None and old[source] == item:
            lines.append(text[slice(*spans[source])])
            continue
        data, comments = item, list[str]()
        if source is not None:
            data = merged_data(data_of(node.value[source]), old[source], item)
            comments = find_comments(text[slice(*spans[source])])
        lines.append("  ".join([f"{margin}- {line_text(data)}", *comments]) + "\n")
    left = (find_comments(text[slice(*spans[i])]) for i in gone)
    return "".join([*lines, *(f"{margin}{each}\n" for comments in left for each in comments)])


def _line_start(text: str, node: Node) -> int:
    return text.rfind("\n", 0, node.start_mark.index) + 1


def merged_data(said: Data, old: Data, new: Data) -> Data:
    """Return the new content, with people's own keys and the spelling of unchanged parts.

    Args:
        said: The present content.
        old: The present content as mapspeak would write it.
        new: The new content as mapspeak writes it.
    """
    if old == new:
        return said
    if isinstance(said, dict) and not isinstance(new, list | None):
        old, new = _as_mapping(old), _as_mapping(new)
        kept = {
            key: merged_data(value, old.get(key), new[key]) if key in new else value
            for key, value in said.items()
            if key in new or key not in old
        }
        return kept | {key: value for key, value in new.items() if value and key not in said}
    if not isinstance(said, list) or not isinstance(old, list) or not isinstance(new, list):
        return new
    if len(said) != len(old):
        return new
    sources, _ = _find_sources(old, new)
    return [
        item if source is None else merged_data(said[source], old[source], item)
        for item, source in zip(new, sources, strict=True)
    ]


def _find_sources(old: list[Data], new: list[Data]) -> tuple[list[int | None], list[int]]:
    """Find which old item each new one continues, and the old ones that none continues.

    An item continues one with the same content, or else one with the same label.
    """
    left = dict(enumerate(old))
    sources: list[int | None] = [None] * len(new)
    for likeness in (lambda item: item, _label):
        for index, item in enumerate(new):
            if sources[index] is None:
                like = (i for i, other in left.items() if likeness(other) == likeness(item))
                sources[index] = next(like, None)
                left.pop(sources[index], None)  # type: ignore[arg-type]  # None is no index
    return sources, list(left)


def _as_mapping(item: Data) -> dict[str, Data]:
    return item if isinstance(item, dict) else {"label": item}


def _label(item: Data) -> Data:
    return _as_mapping(item).get("label")
