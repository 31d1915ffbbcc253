"""Reaching a robot over TLS and over IPv6."""

import datetime as dt
import ipaddress
import ssl
from pathlib import Path

import anyio
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from mapspeak.errors import ConfigError, LinkError
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.ros.link import Patience
from rosbridge_script import PATIENCE_S, Operation, ScriptedServer, Visitor, answering_with, running

pytestmark = pytest.mark.anyio

QUICK = Patience(linger_s=0.0, goodbye_s=1.0)


async def echo(visitor: Visitor, call: Operation) -> None:
    await visitor.answer(call, call["args"])


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certificate that the loopback address signed for itself, its key in the same file."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "a robot")])
    now = dt.datetime.now(dt.UTC)
    built = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - dt.timedelta(days=1))
        .not_valid_after(now + dt.timedelta(days=1))
        .add_extension(
            x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]),
            critical=False,
        )
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    path = tmp_path_factory.mktemp("tls") / "robot.pem"
    path.write_bytes(
        built.public_bytes(serialization.Encoding.PEM)
        + key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return path


def server_context(certificate: Path) -> ssl.SSLContext:
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(certificate)
    return context


async def ask(address: RobotAddress) -> dict[str, object]:
    with anyio.fail_after(PATIENCE_S):
        async with open_client(address, patience=QUICK) as client:
            return await client.call_service("/add", {"a": 1})


async def test_a_robot_with_a_certificate_is_reached_over_tls(certificate: Path) -> None:
    server = ScriptedServer({"call_service": echo})
    async with running(server, ssl_context=server_context(certificate)):
        url = f"wss://127.0.0.1:{server.port}"
        assert await ask(RobotAddress(url=url, ca_file=certificate)) == {"a": 1}


async def test_a_certificate_that_nobody_vouches_for_is_refused(certificate: Path) -> None:
    server = ScriptedServer()
    async with running(server, ssl_context=server_context(certificate)):
        with pytest.raises(LinkError, match="is not trusted") as raised:
            await ask(RobotAddress(url=f"wss://127.0.0.1:{server.port}"))
    assert "CA file" in raised.value.hint


async def test_a_robot_without_tls_is_not_taken_for_one_with(certificate: Path) -> None:
    async with answering_with(b"HTTP/1.1 400 Bad Request\r\n\r\n") as url:
        address = RobotAddress(url=url.replace("ws://", "wss://"), ca_file=certificate)
        with pytest.raises(LinkError, match="does not speak TLS"):
            await ask(address)


async def test_a_ca_file_that_is_none_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"CA file .* cannot be used: No such file"):
        await ask(RobotAddress(url="wss://127.0.0.1:1", ca_file=tmp_path / "none.pem"))


async def test_a_ca_file_that_is_away_for_a_while_only_delays_the_connection(
    certificate: Path, tmp_path: Path
) -> None:
    ca_file = anyio.Path(tmp_path / "ca.pem")
    authority = await anyio.Path(certificate).read_text()
    await ca_file.write_text(authority)
    server = ScriptedServer({"call_service": echo})
    with anyio.fail_after(PATIENCE_S):
        async with running(server, ssl_context=server_context(certificate)):
            address = RobotAddress(url=f"wss://127.0.0.1:{server.port}", ca_file=Path(ca_file))
            async with open_client(address, patience=QUICK) as client:
                await ca_file.unlink()
                await server.drop_all()
                while (client.lost_for_s or 0.0) < 0.05:
                    await anyio.lowlevel.checkpoint()
                with pytest.raises(LinkError, match="has been lost"):
                    await client.call_service("/add", {"a": 1}, timeout_s=0.05)
                await ca_file.write_text(authority)
                assert await client.call_service("/add", {"a": 2}, timeout_s=30.0) == {"a": 2}


async def test_a_ca_file_for_a_connection_without_tls_is_refused(certificate: Path) -> None:
    with pytest.raises(ConfigError, match="not encrypted"):
        RobotAddress(url="ws://127.0.0.1", ca_file=certificate)


async def test_a_robot_is_reached_over_ipv6() -> None:
    server = ScriptedServer({"call_service": echo})
    try:
        listening = running(server, host="::1")
        async with listening:
            assert await ask(RobotAddress(url=f"ws://[::1]:{server.port}")) == {"a": 1}
    except OSError:
        pytest.skip("this machine has no IPv6")
