"""A witness for tests of agents."""

from mapspeak.evaluation.agent import OutOfBudgetError, Picture, ToolAnswer, Witness
from mapspeak.evaluation.trials import ToolCall, Turn


class Hearing(Witness):
    """A witness that writes down what it hears, and lets only so many calls be made."""

    def __init__(self, most: int = 100) -> None:
        self.most = most
        self.made: list[ToolCall] = []
        self.answers: list[ToolAnswer] = []
        self.words: list[tuple[str, int | None]] = []

    @property
    def calls(self) -> list[str]:
        return [call.tool for call in self.made]

    def hear(self, turn: Turn, pictures: tuple[Picture, ...] = ()) -> None:
        if turn.role == "tool":
            answer = ToolAnswer(text=turn.text, pictures=pictures, is_error=turn.is_error)
            self.answers.append(answer)
        elif turn.call is None:
            assert turn.role == "agent"
            self.words.append((turn.text, turn.n_picture_tokens))
        elif len(self.made) >= self.most:
            raise OutOfBudgetError(f"More than {self.most} calls.", hint="Call less.")
        else:
            self.made.append(turn.call)
