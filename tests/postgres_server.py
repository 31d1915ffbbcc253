"""A PostgreSQL server of this machine's own programs, in a folder that is removed."""

import os
import secrets
import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import psycopg
import pytest

USER = "mapspeak_test"


@dataclass(slots=True)
class PostgresServer:
    """A server that can be stopped and started again.

    Attributes:
        folder: Where its files lie.
    """

    folder: Path
    port: int
    password: str = field(repr=False)

    def address(self, database: str = "postgres") -> str:
        """Return the address of one of its databases."""
        return f"postgresql://{USER}:{self.password}@127.0.0.1:{self.port}/{database}"

    def new_database(self) -> str:
        """Make an empty database and return its address."""
        name = f"memory_{secrets.token_hex(4)}"
        with psycopg.connect(self.address(), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}".encode())
        return self.address(name)

    def start(self) -> None:
        """Start it, and return when it can be reached."""
        said = f"-p {self.port} -c listen_addresses=127.0.0.1 -c unix_socket_directories=''"
        self._control("start", "-w", "-l", str(self.folder / "log"), "-o", said)

    def stop(self) -> None:
        """End it and every connection to it at once."""
        self._control("stop", "-w", "-m", "immediate")

    def _control(self, *arguments: str) -> None:
        _call("pg_ctl", "-D", str(self.folder / "data"), *arguments)


@contextmanager
def run_postgres(folder: Path) -> Iterator[PostgresServer]:
    """Run a server of its own.

    Args:
        folder: Empty, and reachable for everybody: PostgreSQL refuses to run as root.
    """
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    server = PostgresServer(folder=folder, port=port, password=secrets.token_hex(8))
    word = folder / "password"
    word.write_text(server.password)
    if os.geteuid() == 0:
        for path in (folder, word):
            shutil.chown(path, "postgres", "postgres")
    how = ("--no-sync", "--encoding=UTF8", "--locale=C", "--auth=scram-sha-256")
    _call("initdb", "-D", str(folder / "data"), "-U", USER, f"--pwfile={word}", *how)
    server.start()
    try:
        yield server
    finally:
        server.stop()


def _call(program: str, *arguments: str) -> None:
    subprocess.run(  # noqa: S603 - PostgreSQL's own programs
        [_find_program(program), *arguments],
        check=True,
        stdout=subprocess.DEVNULL,
        user="postgres" if os.geteuid() == 0 else None,
        cwd="/",
    )


def _find_program(name: str) -> str:
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    found = shutil.which(name, path=os.pathsep.join([os.environ["PATH"], *map(str, folders)]))
    if found is None:
        pytest.fail(f"There is no {name}: install PostgreSQL (apt install postgresql).")
    return found
