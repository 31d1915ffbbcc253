"""Agents: whoever carries out an assignment by calling tools."""

from mapspeak.evaluation.agents.finding import agent_names, check_agent, find_agent

__all__ = ["agent_names", "check_agent", "find_agent"]
