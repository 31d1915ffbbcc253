"""Agents: whoever carries out an assignment by calling tools."""

from mapspeak.evaluation.agents.agent import Agent, AgentEnd, Assignment, ServerAccess
from mapspeak.evaluation.agents.finding import agent_names, check_agent, find_agent

__all__ = [
    "Agent",
    "AgentEnd",
    "Assignment",
    "ServerAccess",
    "agent_names",
    "check_agent",
    "find_agent",
]
