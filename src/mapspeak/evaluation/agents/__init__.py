"""Agents, which carry out assignments by calling tools."""
