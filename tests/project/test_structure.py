"""The tree of the source: one name for one thing, no circles, words only where they are said.

`structure_left.json` holds what is left to mend: each of its lists may only become shorter.
"""

import json
from functools import cache
from pathlib import Path
from typing import Any

from project.structure import (
    find_circles,
    find_doubled_classes,
    find_fields_with_words,
    find_rings,
    find_texts_with_tools,
    read_source,
)

LEFT = Path(__file__).with_name("structure_left.json")

source = cache(read_source)


def left(what: str) -> Any:  # noqa: ANN401 - as the file has it
    return json.loads(LEFT.read_text(encoding="utf-8"))[what]


def test_no_two_public_classes_share_a_name() -> None:
    assert find_doubled_classes(source()) <= set(left("public classes that share a name"))


def test_no_folders_import_each_other_in_circles() -> None:
    assert find_circles(source()) <= set(map(tuple, left("folders in circles of imports")))


def test_no_modules_import_each_other_in_rings() -> None:
    assert find_rings(source()) == set()


def test_no_text_below_the_server_names_a_tool() -> None:
    n_texts = sum(find_texts_with_tools(source()).values())
    assert n_texts <= left("texts below the server that name a tool")


def test_no_value_below_the_server_holds_words_for_a_reader() -> None:
    assert find_fields_with_words(source()) <= set(left("fields below the server that hold words"))
