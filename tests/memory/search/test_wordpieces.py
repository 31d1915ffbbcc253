import pytest

from mapspeak.memory.search.wordindex import read_wordpieces, read_words


@pytest.mark.parametrize(
    ("piece", "number"), [("[UNK]", 100), ("[CLS]", 101), ("[SEP]", 102), ("where", 2073)]
)
def test_the_pieces_have_the_numbers_that_bert_gives_them(piece: str, number: int) -> None:
    assert read_wordpieces()[number] == piece
    assert len(read_wordpieces()) == 30522


def test_a_word_of_the_language_is_told_from_a_misspelt_one() -> None:
    assert "stairs" in read_words()
    assert "extinguihser" not in read_words()
