import difflib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.memory.search.answer import MatchKind
from mapspeak.memory.search.wordindex import LookAlikes, Vocabulary, content_words

WORDS = Vocabulary(["charger", "charging", "dishwasher", "kitchen", "sink", "vegetable"])


@pytest.mark.parametrize(
    ("word", "spellings"),
    [
        ("sink", {"sink": MatchKind.SAME}),
        ("sinks", {"sink": MatchKind.FORM}),
        ("charge", {"charger": MatchKind.FORM, "charging": MatchKind.FORM}),
        ("kichten", {"kitchen": MatchKind.MISSPELT}),
        ("dish", {"dishwasher": MatchKind.PART}),
        ("car", {}),
        ("pool", {}),
    ],
)
def test_a_word_counts_as_those_of_its_stem_or_part_or_else_as_those_like_it(
    word: str, spellings: dict[str, MatchKind]
) -> None:
    assert WORDS.find_spellings(word) == spellings


def test_a_known_word_is_not_misspelt() -> None:
    assert Vocabulary(["leather"]).find_spellings("lether") == {"leather": MatchKind.MISSPELT}
    assert Vocabulary(["leather"]).find_spellings("weather") == {}


@given(st.lists(st.text("abcäö소", min_size=1), max_size=8), st.text("abcdäö소", min_size=4))
def test_no_likeness_is_lost_by_counting_letters_first(words: list[str], word: str) -> None:
    found = LookAlikes(words).find(word, least_ratio=0.8, limit=3)

    assert found == difflib.get_close_matches(word, sorted(set(words)), n=3, cutoff=0.8)


@pytest.mark.parametrize(
    ("phrase", "words"),
    [
        ("Where's the sink?", ["sink"]),
        ("I'm thirsty, it won't stop", ["thirsty", "won", "stop"]),
        ("take me to aisle A", ["aisle", "A"]),
        ("a nurses' station", ["nurses", "station"]),
        ("a", []),
        ("", []),
    ],
)
def test_words_that_say_nothing_are_left_out(phrase: str, words: list[str]) -> None:
    assert [shown for shown, _ in content_words(phrase)] == words
