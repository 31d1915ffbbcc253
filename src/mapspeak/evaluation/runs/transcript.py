"""Hears a trial: writes every turn and picture down at once, and holds the agent to its limits."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mapspeak.evaluation.client import OutOfBudgetError, ToolAnswer
from mapspeak.evaluation.trials import Limits, ToolCall, Turn
from mapspeak.evaluation.trials.records import TURNS, turn_line
from mapspeak.simulator import StateRecord

__all__ = ["Transcript"]


class Transcript:
    """The witness of one trial.

    Args:
        folder: The trial's.
        limits: What it may cost; wall time is watched from outside.
        look: Gives how the simulation truly stands.
        on_turn: Told of every turn; None for nobody.

    Attributes:
        n_turns: Written so far.
        n_calls: Tool calls so far.
        n_errors: Calls that were answered with an error.
        n_words: Times that the agent spoke besides calls.
        n_tokens: Read and written by a model so far.
        calls: Every call in its order.
    """

    def __init__(
        self,
        folder: Path,
        limits: Limits,
        look: Callable[[], StateRecord],
        on_turn: Callable[[Turn], None] | None = None,
    ) -> None:
        self.n_turns = 0
        self.n_calls = 0
        self.n_errors = 0
        self.n_tokens = 0
        self.calls: list[ToolCall] = []
        self._limits = limits
        self._look = look
        self._on_turn = on_turn
        self._begun_s = time.perf_counter()
        self._pictures = folder / "pictures"
        self._turns = (folder / TURNS).open("wb")

    def hear_call(self, tool: str, arguments: dict[str, Any]) -> None:
        """Write a call down.

        Raises:
            OutOfBudgetError: It would be one too many, or comes too late.
        """
        self._check_limits()
        self.n_calls += 1
        call = ToolCall(tool=tool, arguments=arguments)
        self.calls.append(call)
        self._write("agent", call=call)

    def hear_answer(self, tool: str, arguments: dict[str, Any], answer: ToolAnswer) -> None:
        """Write an answer down and keep its pictures."""
        self.n_errors += answer.is_error
        names = [self._keep(picture.data, picture.suffix) for picture in answer.pictures]
        self._write(
            "tool",
            answer.text,
            call=ToolCall(tool=tool, arguments={}),
            is_error=answer.is_error,
            pictures=tuple(names),
        )
        del arguments

    def hear_words(
        self,
        role: str,
        text: str,
        *,
        n_input_tokens: int | None = None,
        n_output_tokens: int | None = None,
        n_picture_tokens: int | None = None,
    ) -> None:
        """Write down what was said besides calls.

        Raises:
            OutOfBudgetError: The model has read and written more than it may.
        """
        self.n_tokens += (n_input_tokens or 0) + (n_output_tokens or 0)
        self._write(
            role,
            text,
            n_input_tokens=n_input_tokens,
            n_output_tokens=n_output_tokens,
            n_picture_tokens=n_picture_tokens,
        )
        most = self._limits.n_tokens
        if most is not None and self.n_tokens > most:
            raise OutOfBudgetError(
                f"{self.n_tokens} tokens are more than {most}.", hint="Raise the limit."
            )

    def close(self) -> None:
        """End the file."""
        self._turns.close()

    def _check_limits(self) -> None:
        limits = self._limits
        if self.n_calls >= limits.n_calls:
            raise OutOfBudgetError(
                f"More than {limits.n_calls} calls.", hint="Decide with fewer calls."
            )
        if self._look().time_s > limits.robot_time_s:
            raise OutOfBudgetError(
                f"More than {limits.robot_time_s:.0f} s of robot time.", hint="Drive less."
            )

    def _write(self, role: str, text: str = "", **more: Any) -> None:  # noqa: ANN401 - fields of Turn
        state = self._look()
        turn = Turn(
            role=role,
            text=text,
            wall_s=round(time.perf_counter() - self._begun_s, 3),
            robot_s=state.time_s,
            pose=state.pose,
            **more,
        )
        self.n_turns += 1
        self._turns.write(turn_line(turn))
        self._turns.flush()
        if self._on_turn is not None:
            self._on_turn(turn)

    def _keep(self, data: bytes, suffix: str) -> str:
        self._pictures.mkdir(exist_ok=True)
        name = f"{self.n_turns:03d}{suffix}"
        if (self._pictures / name).exists():
            name = f"{self.n_turns:03d}-{len(list(self._pictures.iterdir()))}{suffix}"
        (self._pictures / name).write_bytes(data)
        return name
