"""Message definitions in ROS's own language, as they are sent together."""

import re

from mapspeak.ros.messages import bare_type

RULER = re.compile(r"^=+\nMSG: (?P<name>\S+)\n", re.MULTILINE)


def split_definition(type_name: str, text: str) -> dict[str, str]:
    """Gives the text of a type and of each type within it, by name as "package/Type".

    Args:
        type_name: Of the first.
        text: All of them, with a ruler and "MSG: package/Type" before each but the first.
    """
    first, *rest = RULER.split(text)
    texts = {bare_type(type_name): first.strip("\n")}
    for name, part in zip(rest[::2], rest[1::2], strict=True):
        texts.setdefault(bare_type(name), part.strip("\n"))
    return texts
