"""Client programs as agents: Claude Code, Codex, Gemini CLI, or any other that speaks MCP."""

from mapspeak.evaluation.agents.command.agent import CommandAgent
from mapspeak.evaluation.agents.command.program import AnswerForm, Program, find_program

__all__ = ["AnswerForm", "CommandAgent", "Program", "find_program"]
