"""Recorded answers of the tools: what a model read before a change, to hold it against after."""
