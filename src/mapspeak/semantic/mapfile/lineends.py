"""How the lines of a file end: a write leaves each line that it does not change as it was."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

__all__ = ["LineEnds"]

LF, CRLF = "\n", "\r\n"


@dataclass(frozen=True, slots=True)
class LineEnds:
    """The line ends of a file that was read.

    Attributes:
        usual: What most of its lines end in, and every new one.
        lines: Its lines without their ends.
        ends: What each of them ends in, but the last; both are empty where all end alike.
    """

    usual: str
    lines: tuple[str, ...] = ()
    ends: tuple[str, ...] = ()

    @classmethod
    def of(cls, decoded: str) -> "LineEnds":
        """Takes them from a file's text."""
        if "\r" not in decoded:
            # To look for one letter costs a hundredth of counting two.
            return cls(LF)
        n_lines, n_crlf = decoded.count(LF), decoded.count(CRLF)
        usual = CRLF if 2 * n_crlf > n_lines else LF
        if n_crlf in (0, n_lines):
            return cls(usual)
        *ended, last = decoded.split(LF)
        ends = tuple(CRLF if line.endswith("\r") else LF for line in ended)
        return cls(usual, (*(line.removesuffix("\r") for line in ended), last), ends)

    def restored(self, text: str) -> str:
        """Gives a text whose lines end in a line feed with the ends of this file.

        Args:
            text: What the file is to say; most of its lines stood in the file before.
        """
        if not self.lines:
            return text if self.usual == LF else text.replace(LF, self.usual)
        *ended, last = text.split(LF)
        ends = [self.usual] * len(ended)
        for before, after in _same_lines(self.lines[:-1], ended):
            ends[after] = self.ends[before]
        return "".join(line + end for line, end in zip(ended, ends, strict=True)) + last


def _same_lines(before: Sequence[str], after: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Gives the numbers of lines that are the same, before and after."""
    n_least = min(len(before), len(after))
    n_top = next((i for i in range(n_least) if before[i] != after[i]), n_least)
    n_most = n_least - n_top
    n_end = next((i for i in range(n_most) if before[-1 - i] != after[-1 - i]), n_most)
    yield from ((i, i) for i in range(n_top))
    yield from ((len(before) - 1 - i, len(after) - 1 - i) for i in range(n_end))
    old, new = before[n_top : len(before) - n_end], after[n_top : len(after) - n_end]
    if len(old) == len(new):
        # Values were changed in their places.
        yield from ((n_top + i, n_top + i) for i in range(len(old)) if old[i] == new[i])
        return
    for block in SequenceMatcher(None, old, new).get_matching_blocks():
        yield from ((n_top + block.a + i, n_top + block.b + i) for i in range(block.size))
