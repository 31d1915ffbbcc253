"""How long the client waits, in seconds of the wall clock."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """The time limits of one client; a test shortens them.

    Attributes:
        connect_s: For one attempt to connect, handshake included.
        answer_s: For a service's answer, where the caller says nothing else.
        attempt_s: For a connection that has been gone for longer than that: one more attempt.
        first_pause_s: Before the first attempt to reconnect; doubled after each failure.
        longest_pause_s: Between two attempts to reconnect.
        ping_s: Between two pings.
        silence_s: Without a single byte, pongs included, after which a socket counts as dead.
        linger_s: From the last publication to closing, so that the robot still gets it.
        goodbye_s: For the closing handshake.
        retired_s: How long a replaced socket may still answer what it was asked.
        frames_s: For the robot's frames to lead from the map to its base; static ones come at once,
            moving ones many times a second.
    """

    connect_s: float = 5.0
    answer_s: float = 5.0
    attempt_s: float = 0.5
    first_pause_s: float = 0.1
    longest_pause_s: float = 1.0
    ping_s: float = 5.0
    silence_s: float = 20.0
    linger_s: float = 0.15
    goodbye_s: float = 0.5
    retired_s: float = 30.0
    frames_s: float = 2.0
