"""Agents: whoever carries out an assignment by calling tools."""
