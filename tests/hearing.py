"""A witness for tests of agents."""

from typing import Any

from mapspeak.evaluation.client import OutOfBudgetError, ToolAnswer


class Hearing:
    """A witness that writes down what it hears, and lets only so many calls be made."""

    def __init__(self, most: int = 100) -> None:
        self.most = most
        self.calls: list[str] = []
        self.answers: list[ToolAnswer] = []
        self.words: list[tuple[str, dict[str, int | None]]] = []

    def hear_call(self, tool: str, arguments: dict[str, Any]) -> None:
        del arguments
        if len(self.calls) >= self.most:
            raise OutOfBudgetError(f"More than {self.most} calls.", hint="Call less.")
        self.calls.append(tool)

    def hear_answer(self, tool: str, arguments: dict[str, Any], answer: ToolAnswer) -> None:
        del tool, arguments
        self.answers.append(answer)

    def hear_words(self, role: str, text: str, **n_tokens: int | None) -> None:
        assert role == "agent"
        self.words.append((text, n_tokens))
