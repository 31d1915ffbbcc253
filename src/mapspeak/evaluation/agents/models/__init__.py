"""Models as agents: one loop of tool calls, and the models that may be asked in it."""
