"""A semantic map file that has been read: its sections, the records in them, and a change of one.

A record whose text was seen before is not read again. A write changes the text of one record, or of
the head of one section; every other character stays.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

from mapspeak.errors import SemanticMapError
from mapspeak.memory.frames import OWN_WALLS, Frames, MapFrame
from mapspeak.memory.store.cutting import Section, split_end
from mapspeak.memory.store.editing import edited_item
from mapspeak.memory.store.reading import (
    FIRST_KEYS,
    Contents,
    ListedRecord,
    read_contents,
    read_item,
)
from mapspeak.memory.store.records import (
    FILE_VERSION,
    LISTS,
    Record,
    data_of,
    key_of,
    list_key_of,
)
from mapspeak.memory.store.yamltext import Data, TextFaultError
from mapspeak.memory.store.yamlwriting import entry_text, record_text
from mapspeak.memory.waypoint import SemanticMap, Waypoint

_BOM = "\ufeff"
_GREETING = "# mapspeak semantic map. Edit freely: comments and order are kept.\n"
_LEFT_OUT = ("stamp_s", "recorded_at", "room_id", "picture", "frame", "gone")
"""Keys of a place that a new record has only where they say something."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MapDocument(Contents):
    """A semantic map file that was read without a fault.

    Attributes:
        source: The file, as faults name it.
        line_end: What most of its lines end in, and all that are written.
    """

    source: str
    line_end: str = "\n"
    has_bom: bool = False

    @property
    def text(self) -> str:
        """All of it, with lines that end in a line feed."""
        return "".join(self._texts(self.sections))

    @property
    def content(self) -> bytes:
        """The file's bytes: with its line ends and its byte order mark."""
        text = self.text if self.line_end == "\n" else self.text.replace("\n", self.line_end)
        return ((_BOM if self.has_bom else "") + text).encode()

    @cached_property
    def places(self) -> SemanticMap:
        """The remembered places."""
        return SemanticMap(
            map_id=self.map_id,
            waypoints=cast("tuple[Waypoint, ...]", self.records_of("waypoints")),
            frames=self.frames,
            warnings=self.warnings,
        )

    @cached_property
    def frames(self) -> Frames:
        """All frames but the file's own."""
        frames, walls = self.records_of("frames"), self.root.get("snapshot")
        own_walls = walls if isinstance(walls, str) and walls else OWN_WALLS
        return Frames(cast("tuple[MapFrame, ...]", frames), own_walls)

    def records_of(self, list_key: str) -> tuple[Record, ...]:
        """Return all records of a list, in the order of the file."""
        return tuple(item.record for item in self.lists[list_key].values())

    def find(self, list_key: str, key: str) -> Record | None:
        """Return the record of a list with a key."""
        item = self.lists[list_key].get(key)
        return None if item is None else item.record

    def _texts(self, sections: Iterable[Section]) -> list[str]:
        texts = list[str]()
        for section in sections:
            texts.append(section.head)
            if section.key in LISTS:
                texts += [item.text or "" for item in self.lists[section.key].values()]
        return texts

    # --- changes ---------------------------------------------------------------------------------

    def bound_to(self, map_id: str | None) -> "MapDocument":
        """Return the file with the map of its waypoints, unless it already names one."""
        if self.map_id is not None or map_id is None:
            return self
        entry = entry_text("map", map_id, indent=0)
        sections = list(self.sections)
        at = next((i for i, each in enumerate(sections) if each.key == "map"), None)
        if at is not None:
            _, mark, comment = sections[at].head.partition("#")
            behind = f"  {mark}{comment}" if mark else "\n"
            sections[at] = Section(key="map", head=entry + behind)
            return self._read_again(sections)
        return self._with_section(Section(key="map", head=f"{entry}\n"), self._find_places())

    def with_record(self, record: Record, *, former_key: str | None = None) -> "MapDocument":
        """Return the file with a record written, in place of the one with its key if there is one.

        Args:
            former_key: The key of the record to replace, if not the same; one that had the new key
                is removed.

        Raises:
            SemanticMapError: The file is laid out in a way that cannot be written to.
        """
        list_key, key, data = list_key_of(record), key_of(record), data_of(record)
        items = self.lists[list_key]
        former_key = former_key or key
        item = items.get(former_key)
        section = next((each for each in self.sections if each.key == list_key), None)
        if item is not None:
            if item.text is None or section is None:
                raise self._layout_fault(list_key)
            text = _changed_text(item.text, data_of(item.record), data, section.indent)
            new = self._read_item(list_key, text, data)
            left = items if former_key == key else {k: v for k, v in items.items() if k != key}
            changed = {(key if k == former_key else k): v for k, v in left.items()} | {key: new}
            return replace(self, lists={**self.lists, list_key: changed})
        if section is None:
            text = _new_text(data, 2)
            at = self._find_places() if list_key == "frames" else len(self.sections)
            return self._with_section(Section(key=list_key, head=f"{list_key}:\n" + text), at)
        if not items:
            return self._with_first(section, _new_text(data, 2))
        new = self._read_item(list_key, _new_text(data, section.indent), data)
        return self._with_last(section, new)

    def _with_last(self, section: Section, new: ListedRecord) -> "MapDocument":
        """Return the file with an item inserted directly after the last one."""
        items = dict(self.lists[section.key])
        *others, last = items.values()
        if last.text is None or new.text is None:
            raise self._layout_fault(section.key)
        body, rest = split_end(last.text, section.indent)
        is_airy = section.key == "waypoints" and (
            not others or split_end(others[-1].text or "", section.indent)[1].startswith("\n")
        )
        gap = "\n" if is_airy else ""
        items[last.key] = replace(last, text=_ended(body) + gap)
        items[new.key] = replace(new, text=new.text + rest)
        return replace(self, lists={**self.lists, section.key: items})

    def _with_first(self, section: Section, text: str) -> "MapDocument":
        """Return the file with a first item below a key, in place of `[]`, null or nothing."""
        line, _, rest = section.head.partition("\n")
        key, _, said = line.partition(":")
        value, mark, comment = said.partition("#")
        if value.strip() not in ("", "[]", "{}", "null", "~"):
            raise self._layout_fault(section.key)
        space = "  " if value.strip() else value
        behind = f"{space}{mark}{comment}" if mark else ""
        changed = replace(section, head=f"{key}:{behind}\n{text}{rest}")
        return self._read_again([changed if s is section else s for s in self.sections])

    def _find_places(self) -> int:
        """Return the index of the section of places; the number of sections if there is none."""
        keys = [section.key for section in self.sections]
        return keys.index("waypoints") if "waypoints" in keys else len(keys)

    def _with_section(self, section: Section, at: int) -> "MapDocument":
        sections = list(self.sections)
        if not self.root and not any(self.lists.values()):
            greeting = self.text or _GREETING
            sections = [Section(key="", head=f"{_ended(greeting)}version: {FILE_VERSION}\n")]
            at = 1
        end = "".join(self._texts(sections[:at]))
        if end and not end.endswith("\n"):
            section = replace(section, head="\n" + section.head)
        return self._read_again([*sections[:at], section, *sections[at:]])

    def _read_again(self, sections: list[Section]) -> "MapDocument":
        """Read the changed text again before it is used."""
        try:
            contents = read_contents("".join(self._texts(sections)), self)
        except SemanticMapError as error:
            raise self._layout_fault("waypoints") from error
        after = replace(self, **vars(contents))
        for list_key, items in self.lists.items():
            if not items.keys() <= after.lists[list_key].keys():
                raise self._layout_fault(list_key)
        return after

    def _read_item(self, list_key: str, text: str, data: dict[str, Data]) -> ListedRecord:
        """Return a record as read from its new text."""
        item = read_item(list_key, text, self.map_id)
        if data_of(item.record) != data:
            raise self._layout_fault(list_key)
        return item

    def _layout_fault(self, list_key: str) -> SemanticMapError:
        return SemanticMapError(
            f"{self.source}: mapspeak reads this layout, but cannot write to it.",
            hint=f"Put `{list_key}:` at the start of a line and each of its items below it as "
            f"`- {FIRST_KEYS[list_key]}: ...`, its other keys on lines of their own. Nothing was "
            "written.",
        )


def _new_text(data: dict[str, Data], indent: int) -> str:
    """Return the text of a record that mapspeak writes."""
    shown = {name: said for name, said in data.items() if said or name not in _LEFT_OUT}
    return record_text(shown, indent=indent)


def _changed_text(text: str, old: dict[str, Data], new: dict[str, Data], indent: int) -> str:
    """Return the changed text of a record."""
    own, rest = _new_text(old, indent), text.lstrip("\n")
    if rest.startswith(own) and not rest[len(own) :].strip("\n"):
        # Nothing else edited it.
        return text.replace(own, _new_text(new, indent))
    return edited_item(text, indent=indent, old=old, new=new)


def _ended(text: str) -> str:
    return text if not text or text.endswith("\n") else text + "\n"


def parse_document(content: bytes, *, source: str, previous: Contents | None = None) -> MapDocument:
    """Read a semantic map file.

    Args:
        previous: The previous reading; unchanged records are not parsed again.

    Raises:
        SemanticMapError: It has a fault; the message names the line and the column.
    """
    try:
        decoded = content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        message = f"{source}, line {line}: byte {error.start} is not UTF-8."
        raise SemanticMapError(message, hint="Save the file with the encoding UTF-8.") from error
    text = decoded.removeprefix(_BOM).replace("\r\n", "\n")
    try:
        contents = read_contents(text, previous or Contents())
    except TextFaultError as fault:
        other = "" if fault.other_line is None else f" The other one is on line {fault.other_line}."
        raise SemanticMapError(
            f"{source}, line {fault.line}, column {fault.column}: {fault.message}{other}",
            hint=fault.hint,
        ) from fault
    return MapDocument(
        source=source,
        line_end="\r\n" if 2 * decoded.count("\r\n") > decoded.count("\n") else "\n",
        has_bom=decoded.startswith(_BOM),
        **vars(contents),
    )
