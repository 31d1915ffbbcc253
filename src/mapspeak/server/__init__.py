"""The MCP surface: tools, and all words for the model. What loads it all is `server.app`."""
