"""The services of the robot's nodes."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

Values = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """One service.

    Attributes:
        name: With its leading slash.
        type: As "package/Type".
        node: Which offers it.
        answer: Gives the response for a request; None for a service that never answers.
    """

    name: str
    type: str
    node: str
    answer: Callable[[Values], Awaitable[Values]] | None


class Services:
    """All services there are."""

    def __init__(self) -> None:
        self._services: dict[str, Service] = {}

    @property
    def all(self) -> list[Service]:
        """The services by name."""
        return sorted(self._services.values(), key=lambda service: service.name)

    def add(self, service: Service) -> None:
        """Offers one more."""
        self._services[service.name] = service

    def find(self, name: str) -> Service | None:
        """Finds a service; a leading slash may be missing."""
        return self._services.get(f"/{name.strip('/')}")
