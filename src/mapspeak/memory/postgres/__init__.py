"""The memory of a fleet, in PostgreSQL; needs the extra `postgres`."""

from mapspeak.memory.postgres.database import MIGRATIONS, shown_address
from mapspeak.memory.postgres.store import PostgresStore

__all__ = ["MIGRATIONS", "PostgresStore", "shown_address"]
