"""Client programs as agents: Claude Code, Codex, Gemini CLI, or any other that speaks MCP."""
