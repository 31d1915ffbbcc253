"""How long to wait for a robot and its ROS: every limit of one connection."""

from dataclasses import dataclass

from mapspeak.robot import SCAN_PATIENCE_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """The limits of one connection, in wall time; a test shortens them.

    Between nodes on Fast DDS, a lost message comes again after three seconds: a shorter wait would
    take a lost message for a silent robot.

    Attributes:
        settling_s: After connecting, without anything new, until all that is there is found.
        frames_s: For the robot's frames to lead from the map to its base; static ones come at once,
            moving ones many times a second.
        first_map_s: For the first map, which is asked for anew after each of these waits: a
            subscription made before the robot's side knew the publisher never gets the latched
            map. Empty stands for what is usual over the connection.
        later_map_s: For a map that nobody publishes, or that was waited for in vain before.
        standstill_s: Without a tick, after which a simulation's clock stands still.
        pose_silence_s: Without anything new of the pose, after which it is too old.
        first_picture_s: For the first picture of a camera that is published and has said nothing
            yet: some give one in ten seconds.
        picture_s: For a later picture; longer for a slow camera.
        scan_s: For a scan.
        acceptance_s: For the first sign that a goal was taken.
        listing_s: For the list of the goals there are, before our own first one.
        end_s: For a goal to end that was cancelled or replaced.
        result_s: For the result of a goal whose end is known already.
        return_s: After a reconnection, for word of a goal that was under way.
        connect_s: For a socket of rosbridge to open.
        answer_s: For a service's answer, where the caller says nothing else.
        attempt_s: For a connection that has been gone for longer than that: one more attempt.
        first_pause_s: Before the first attempt to reconnect; doubled after each failure.
        longest_pause_s: Between two attempts to reconnect.
        ping_s: Between two pings over a socket.
        silence_s: Without a single byte, pongs included, after which a socket counts as dead.
        linger_s: From the last publication to closing, so that the robot still gets it.
        goodbye_s: For the other end to agree to closing.
        retired_s: How long a replaced socket may still answer what it was asked.
    """

    settling_s: float = 5.0
    frames_s: float = 2.0
    first_map_s: tuple[float, ...] = ()
    later_map_s: float = 2.0
    standstill_s: float = 5.0
    pose_silence_s: float = 10.0
    first_picture_s: float = 15.0
    picture_s: float = 5.0
    scan_s: float = SCAN_PATIENCE_S
    acceptance_s: float = 5.0
    listing_s: float = 0.3
    end_s: float = 4.0
    result_s: float = 1.0
    return_s: float = 5.0
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


USUAL_PATIENCE = Patience()
