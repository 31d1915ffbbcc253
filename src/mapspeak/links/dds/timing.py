"""How long the connection waits, in seconds of the wall clock."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class DdsTiming:
    """The time limits of one connection; a test shortens them.

    Attributes:
        answer_s: For a service's answer, where the caller says nothing else.
        first_sign_s: For the first node of ROS to be found.
        quiet_s: Without anybody new, after which all who are there count as found.
        longest_look_s: For all who are there to be found.
        arrival_s: For what was published last to arrive, before we leave.
    """

    answer_s: float = 5.0
    first_sign_s: float = 5.0
    quiet_s: float = 0.4
    longest_look_s: float = 3.0
    arrival_s: float = 0.5
