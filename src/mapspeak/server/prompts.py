"""What the server tells a model before it starts: instructions, and the paper's two prompts.

The exploration prompt is the paper's appendix word for word. The paper describes its semantic
filtering policy without quoting it; the three categories are in the paper's words, and what is
left out is said by `mapspeak.memory`, which holds every record to it.
"""

from importlib import resources

from mcp.server import MCPServer

from mapspeak.memory import LEFT_OUT


def read_text(name: str) -> str:
    """Return one of the texts that come with the server: instructions, exploration, ..."""
    return (resources.files("mapspeak.server") / "texts" / f"{name}.txt").read_text("utf-8").strip()


def policy_text() -> str:
    """Return the semantic filtering policy: what is kept, and what is left out."""
    return "\n".join([read_text("semantic_policy"), *(f"- {line}" for line in LEFT_OUT.values())])


def add_prompts(server: MCPServer) -> None:
    """Register the paper's exploration prompt and its semantic filtering policy."""

    @server.prompt(title="Explore and map (the paper's exploration prompt)")
    def exploration() -> str:
        """Explores the building waypoint by waypoint and records what is seen."""
        return f"{read_text('exploration')}\n\n{policy_text()}"

    @server.prompt(title="Semantic map policy")
    def semantic_policy() -> str:
        """Says which observations belong into the semantic map."""
        return policy_text()
