"""What a trial imports on its way, imported at once: processes forked from here have it."""

import mcp.client.stdio
import ruamel.yaml
from PIL import BmpImagePlugin, JpegImagePlugin, PngImagePlugin

__all__: list[str] = []

_LOADED = (
    mcp.client.stdio,
    ruamel.yaml,
    BmpImagePlugin,
    JpegImagePlugin,
    PngImagePlugin,
)
