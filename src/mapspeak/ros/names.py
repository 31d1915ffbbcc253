"""What ROS allows as a name, and as the name of a type."""

import re
import uuid

NAME = re.compile(r"[~/]?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")
TYPE = re.compile(r"[A-Za-z]\w*(?:/(?:msg|srv|action))?/[A-Za-z]\w*")


def new_id() -> str:
    """Gives an id that no other client of the same robot uses: 32 hex digits."""
    return uuid.uuid4().hex
