"""What `hapticvlm doctor` checks on the network: the port, who has it, the certificate."""

from __future__ import annotations

import asyncio
import errno
import socket
import ssl
import time

from hapticvlm.client import Refused, connect
from hapticvlm.doctor.findings import Finding
from hapticvlm.server.settings import ServeOptions

ASK_S = 1.5
SOON_DAYS = 14.0
_ANY = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # where to ask, not where to listen


def address(options: ServeOptions) -> list[Finding]:
    """Check whether the service would listen as asked, and how long its certificate lasts."""
    from hapticvlm.server import service_info

    try:
        where = service_info.address(options)
    except ValueError as error:
        return [Finding("address", "wrong", str(error), "`hapticvlm serve --help`")]
    if where.certificate is None:
        return []
    days = (where.certificate.ends_at - time.time()) / 86400.0
    text = f"for {', '.join(sorted(where.certificate.names)) or 'no name'}, {days:.0f} days left"
    if days < SOON_DAYS:
        return [Finding("certificate", "note", text, "make a new one soon")]
    return [Finding("certificate", "ok", text)]


def port(options: ServeOptions) -> Finding:
    """Check whether the port is free, or who answers there."""
    address = f"{options.host}:{options.port}"
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    try:
        with socket.create_server((options.host, options.port), family=family):
            return Finding("port", "ok", f"{address} is free")
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            return asyncio.run(_who(options, address))
        reason = f"{address}: {error.strerror}"
        cure = "another --host or --port"
        return Finding("port", "wrong", reason, cure)


async def _who(options: ServeOptions, address: str) -> Finding:
    """Connect to what listens at the port, as an observer would."""
    host = _ANY.get(options.host, options.host)
    tls = None
    if options.tls_cert is not None:
        tls = ssl.create_default_context()
        # we only ask who is there
        tls.check_hostname = False
        tls.verify_mode = ssl.CERT_NONE
    shown = f"[{host}]" if ":" in host else host
    url = f"ws{'s' if tls else ''}://{shown}:{options.port}/"
    cure = "stop it before you start another, or take another --port"
    try:
        async with (
            asyncio.timeout(ASK_S),
            connect(url, name="doctor", role="observer", token=options.token, tls=tls) as client,
        ):
            version = client.welcome["service"]["version"]
            return Finding("port", "note", f"{address}: hapticvlm {version} runs there", cure)
    except Refused:
        reason = f"{address}: a hapticvlm runs there, with another token or protocol"
        return Finding("port", "note", reason, cure)
    except Exception as error:  # noqa: BLE001 - an unknown program may answer anything
        reason = f"{address}: another program has it ({type(error).__name__})"
        return Finding("port", "wrong", reason, "take another --port")
