"""ROS messages as a model reads them: short, whatever they hold."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.server.text.values import cut, show_message, show_value

ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=30,
)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (True, "true"),
        (None, "null"),
        (1.23456789, "1.23457"),
        ([1, 2, 3], "[1, 2, 3]"),
        ([0.0] * 36, "[36 numbers, all 0]"),
        (np.arange(100, dtype=np.int8), "[100 numbers, 0 to 99; first 0, 1, 2]"),
        (np.zeros((2, 50)), "[numbers, shape (2, 50), all 0]"),
        ([None] * 10, "[10 numbers, none finite]"),
        ([1.0, math.inf] * 10, "[20 numbers, all 1, 10 not finite]"),
        (b"12345", "[5 bytes]"),
        ({"sec": 1, "nanosec": 500_000_000}, "1.500 s"),
        ({"secs": 2, "nsecs": 0}, "2.000 s"),
        ([{"x": 1}] * 5, "[{x: 1}, {x: 1}, {x: 1}, ... 2 more]"),
        (10**400, "a huge number"),
    ],
)
def test_a_value_is_said_shortly(value: object, said: str) -> None:
    assert show_value(value) == said


def test_a_long_text_is_cut_and_its_length_told() -> None:
    shown = show_value("x" * 1000)
    assert shown.endswith('..." (1,000 letters)')
    assert len(shown) < 250


def test_a_message_stands_field_by_field() -> None:
    message = {"a": 1, "b": {"name": "n" * 60, "other": "o" * 60}}
    assert show_message(message).splitlines() == [
        "a: 1",
        "b:",
        f'  name: "{"n" * 60}"',
        f'  other: "{"o" * 60}"',
    ]


@given(st.dictionaries(st.text(), ANYTHING, max_size=20))
def test_no_message_is_longer_than_a_model_can_take(message: dict[str, object]) -> None:
    assert len(show_message(message)) <= 3000


def test_what_is_cut_says_so() -> None:
    assert cut("x" * 100, most=100) == "x" * 100
    assert cut("x" * 1000, most=100).endswith("cut: 1,000 letters in all.")
