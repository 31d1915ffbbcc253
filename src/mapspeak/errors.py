"""The errors mapspeak raises on purpose, the steps they lead to, and how causes are told.

MapspeakError           everything below; carries what is wrong and what to do next
|- ConfigError          a flag, a world file or a setting that cannot be used
|- LinkError            the robot cannot be reached, or does not offer what was asked
|- MapError             a map, or a map file, that cannot be what it claims
|- GoalError            a goal that cannot be driven to, or an unknown goal id
|- PolicyError          what the policy, a hold or a person does not allow
|- SkillError           an unknown skill, or an argument that it does not take
`- SemanticMapError     the semantic map file or a record in it is wrong
"""

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import StrEnum


class NextStep(StrEnum):
    """What the reader can do after an error; the server says with which tool."""

    CHOOSE_ON_MAP = "choose_on_map"
    DRIVE_THERE = "drive_there"
    SEE_PLACES = "see_places"
    MEASURE = "measure"
    MEASURE_BETWEEN = "measure_between"
    READ_MORE = "read_more"
    LOOK_AROUND = "look_around"
    LOOK_FROM = "look_from"
    CHECK_NEAR = "check_near"
    WAIT_OR_CANCEL = "wait_or_cancel"
    WAIT_OR_STOP = "wait_or_stop"
    DRIVE_FIRST = "drive_first"
    DRIVE_AGAIN = "drive_again"
    DRIVE_ROUND = "drive_round"
    USE_OTHER_TOOLS = "use_other_tools"
    BEGIN_ROUTE = "begin_route"
    ALIGN = "align"
    END_EVENT = "end_event"
    TAKE_SEVERAL = "take_several"


def say_cause(error: Exception) -> str:
    """Return what is wrong in words, without the number and the path that an OSError puts there."""
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)


def say_nearest(name: str, known: Iterable[str]) -> str:
    """Return a question with the known name that is most like another; empty if none is."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.7)
    return f"Did you mean {near[0]}? " if near else ""


class MapspeakError(Exception):
    """Something that was asked for cannot be done, with a hint at the next step.

    Attributes:
        message: What is wrong, with the number and its unit.
        hint: What the reader can do next, in plain words that name no tool.
        step: The same as a code, where a tool does it.
        about: The id of the place that the step is about; else empty.
    """

    def __init__(
        self, message: str, *, hint: str, step: NextStep | None = None, about: str = ""
    ) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.step = step
        self.about = about

    def __str__(self) -> str:
        return f"{self.message} {self.hint}"


class ConfigError(MapspeakError):
    """A flag, a world file or a setting cannot be used."""


class LinkError(MapspeakError):
    """The robot cannot be reached, or does not offer what was asked of it."""


class MapError(MapspeakError):
    """A map, or a map file, is not what it claims to be."""


class GoalError(MapspeakError):
    """A goal cannot be driven to, or its id is not known."""


class PolicyError(MapspeakError):
    """The policy, a hold or a person does not allow what was asked."""


class SkillError(MapspeakError):
    """A skill is not known, or does not take an argument as it was given."""


class SemanticMapError(MapspeakError):
    """The semantic map file, or a record meant for it, is wrong."""


class DamagedMapError(SemanticMapError):
    """A map that a memory has kept cannot be understood; it is there, and reading goes on."""


@contextmanager
def plain_errors() -> Iterator[None]:
    """Let an error pass as it was raised, out of the group that a task group makes of it."""
    try:
        yield
    except BaseExceptionGroup as group:
        error: BaseException = group
        while isinstance(error, BaseExceptionGroup) and len(error.exceptions) == 1:
            error = error.exceptions[0]
        raise error from error.__cause__
