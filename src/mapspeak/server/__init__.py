"""The MCP surface: tools, and all words for the model. `server.app` loads it all."""
