"""What a trial imports on its way, imported at once: processes forked from here have it.

Only the process that trials are forked from imports this module.
"""

import gc
from importlib import import_module

from PIL import Image

_LATE = (
    "anyio._backends._asyncio",
    "jsonschema",
    "mcp.client.stdio",
    "numpy.fft",
    "numpy.ma",
    "rich.logging",
    "ruamel.yaml",
)
"""What others import only when they first need it; all of it comes with what mapspeak needs."""

for _name in _LATE:
    import_module(_name)
Image.preinit()
# What was loaded stays for good: no trial's collection has to go through it, nor copy its pages.
gc.collect()
gc.freeze()
