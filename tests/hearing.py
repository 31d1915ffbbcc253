"""A witness for tests of agents."""

from typing import Any

from mapspeak.evaluation.client import OutOfBudgetError, ToolAnswer, Witness
from mapspeak.evaluation.trials import ToolCall


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

    def hear_call(self, tool: str, arguments: dict[str, Any]) -> None:
        if len(self.made) >= self.most:
            raise OutOfBudgetError(f"More than {self.most} calls.", hint="Call less.")
        self.made.append(ToolCall(tool=tool, arguments=arguments))

    def hear_answer(self, tool: str, answer: ToolAnswer) -> None:
        del tool
        self.answers.append(answer)

    def hear_words(
        self,
        role: str,
        text: str,
        *,
        n_input_tokens: int | None = None,
        n_output_tokens: int | None = None,
        n_picture_tokens: int | None = None,
    ) -> None:
        assert role == "agent"
        self.words.append((text, n_picture_tokens))
        del n_input_tokens, n_output_tokens
