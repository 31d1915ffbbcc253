"""What was started on a ROS system: known to all who use the connection, so that a stop ends it."""

from typing import Protocol

from mapspeak.ros.messages import Message


class Startable(Protocol):
    """An action on which goals of ours may be under way."""

    @property
    def is_busy(self) -> bool:
        """True while a goal of ours is under way, or may be."""
        ...

    @property
    def owners(self) -> frozenset[str]:
        """The clients with whom goals end that are under way."""
        ...

    async def end(self) -> None:
        """End every goal of ours, also one that the robot takes only later.

        Raises:
            LinkError: Says what could not be ended.
        """
        ...


class Started:
    """Everything that was started over one connection.

    Attributes:
        actions: By name, each with our goals.
        velocities: The zero velocity of each topic on which a velocity was published.
        n_begun: How often something was begun; zero velocity is not repeated beyond that.
        n_stops: Grows with every stop; what was wanted before a stop is not begun after it.
    """

    def __init__(self) -> None:
        self.actions: dict[str, Startable] = {}
        self.velocities: dict[str, Message] = {}
        self.n_begun = 0
        self.n_stops = 0

    @property
    def is_busy(self) -> bool:
        """True while a goal of ours is under way, or may be."""
        return any(action.is_busy for action in self.actions.values())

    @property
    def owners(self) -> frozenset[str]:
        """The clients with whom goals end that are under way."""
        return frozenset().union(*(action.owners for action in self.actions.values()))

    def note_velocity(self, topic: str, *, zero: Message) -> None:
        """Note that a velocity is about to be published on a topic."""
        self.velocities[topic] = zero
        self.n_begun += 1
