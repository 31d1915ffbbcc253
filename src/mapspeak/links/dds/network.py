"""Which network interfaces and domain the DDS link uses."""

from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

MOST_PARTICIPANTS = 100
"""On one machine that are looked for, where they cannot be found by multicast."""
CALL_EVERY_S = 2
"""A robot that is started again is found so soon; the library's own choice is eight seconds."""
FAST_DDS_VENDOR = "1.15"


@dataclass(frozen=True, slots=True, kw_only=True)
class DdsNetwork:
    """A domain, and how its members are found.

    Attributes:
        is_local: Members are on this machine only, as with
            ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
        peers: Addresses of other machines that multicast does not reach, as in ROS_STATIC_PEERS.
        cyclonedds_uri: What else Cyclone DDS is told, as in CYCLONEDDS_URI.
    """

    domain_id: int = 0
    is_local: bool = False
    peers: Sequence[str] = ()
    cyclonedds_uri: str = ""

    @property
    def configuration(self) -> str:
        """All that Cyclone DDS is told, as in CYCLONEDDS_URI.

        A robot on this machine that keeps to itself listens to no multicast: it is looked for at
        the ports it would have, and looks for us at such. Fast DDS describes its types in a way
        that Cyclone DDS finds fault with; we know them by name.
        """
        peers = "".join(f"<Peer address={quoteattr(each)}/>" for each in ("localhost", *self.peers))
        local = '<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
        return (
            f"{self.cyclonedds_uri}{',' if self.cyclonedds_uri else ''}"
            '<CycloneDDS><Domain id="any">'
            f"<General>{local if self.is_local else ''}</General>"
            "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
            f"<MaxAutoParticipantIndex>{MOST_PARTICIPANTS}</MaxAutoParticipantIndex>"
            f"<SPDPInterval>{CALL_EVERY_S} s</SPDPInterval><Peers>{peers}</Peers></Discovery>"
            f"<Compatibility><IgnoreTypeInformation>{FAST_DDS_VENDOR}</IgnoreTypeInformation>"
            "</Compatibility></Domain></CycloneDDS>"
        )
