"""Readers and writers in the robot's own network: their type names and samples."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros.port import EndQuality

SERVICE_PART = re.compile(r"_(?:Request|Response)$")
ACTION_PART = re.compile(r"_(?:SendGoal|GetResult)$|_FeedbackMessage$")
FIRST_SIGN_S = 5.0
"""For the first node of others to be found before we begin without.

A call that is lost on a busy machine comes again after three seconds: so Fast DDS has it.
"""
LONGEST_LOOK_S = 3.0
ARRIVAL_S = 0.5
"""Wait for the last publications to arrive before leaving."""


def full_type(name: str) -> str:
    """Return a type as "package/kind/Type", however it was written; of a message by default."""
    package, *middle, last = name.strip("/").split("/")
    return f"{package}/{middle[0] if middle else 'msg'}/{last}"


def whole_type(part_type: str) -> str:
    """Return the service or action that a type is a part of, or the type itself."""
    return ACTION_PART.sub("", SERVICE_PART.sub("", part_type))


def is_hidden(name: str) -> bool:
    """Return True for names that `ros2 topic list` leaves out, such as the parts of actions."""
    return "/_" in name


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """One received message.

    Attributes:
        content: The message, decoded; None where that failed, or where it is left out.
        source_s: When it was written, by its writer's clock.
        refusal: Why it could not be decoded.
    """

    content: Any
    source_s: float = 0.0
    refusal: LinkError | None = None


Decode = Callable[[bytes], Any]
Take = Callable[[Sample], None]


def understand(data: bytes, decode: Decode, *, source_s: float = 0.0) -> Sample:
    """Return the sample of a message's bytes."""
    try:
        return Sample(content=decode(data), source_s=source_s)
    except LinkError as error:
        return Sample(content=None, source_s=source_s, refusal=error)


@dataclass(frozen=True, slots=True, kw_only=True)
class Endpoint(EndQuality):
    """A reader or a writer in the network.

    Attributes:
        key: Its id in the network, which no other has.
        type_name: As "package/kind/Type".
    """

    key: bytes
    type_name: str


def unknown(name: str) -> LinkError:
    """Return the error for a node, service or action that is not there."""
    return LinkError(
        f"The robot knows no {name[:80]}.", hint="Ask for the list of what there is first."
    )


def no_answer(service: str, timeout_s: float) -> LinkError:
    """Return the error for a service that is there and does not answer."""
    return LinkError(
        f"{service} did not answer within {timeout_s:g} s.",
        hint="The node that serves it may be busy or stuck: ask again, look at its log, or restart "
        "it. The connection is kept.",
    )


def nobody_serves(service: str) -> LinkError:
    """Return the error for a service that is not there."""
    return LinkError(
        f"Nobody serves {service[:80]}.",
        hint="Ask for the list of what there is; the node that offers it may have ended.",
    )
