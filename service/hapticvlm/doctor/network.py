"""Checks the network for `hapticvlm doctor`: the port, the program that has it, the certificate."""

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
_ANY = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # where to connect if the service listens everywhere


def address(options: ServeOptions) -> list[Finding]:
    """Check whether the service could listen there, and how long its certificate is valid."""
    from hapticvlm.server import service_info

    try:
        where = service_info.address(options)
    except ValueError as error:
        return [Finding("address", "wrong", str(error), "see `hapticvlm serve --help`")]
    if where.certificate is None:
        return []
    days = (where.certificate.ends_at - time.time()) / 86400.0
    names = ", ".join(sorted(where.certificate.names)) or "no name"
    message = f"for {names}, {days:.0f} days left"
    if days < SOON_DAYS:
        return [Finding("certificate", "note", message, "renew it soon")]
    return [Finding("certificate", "ok", message)]


def port(options: ServeOptions) -> Finding:
    """Check whether the port is free, or which program answers there."""
    address = f"{options.host}:{options.port}"
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    try:
        with socket.create_server((options.host, options.port), family=family):
            return Finding("port", "ok", f"{address} is free")
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            return asyncio.run(_who(options, address))
        reason = f"{address}: {error.strerror}"
        cure = "choose another --host or --port"
        return Finding("port", "wrong", reason, cure)


async def _who(options: ServeOptions, address: str) -> Finding:
    """Connect to the program at the port, as an observer would.

    The token is not sent: any program may have the port, and the token is for the service alone.
    """
    host = _ANY.get(options.host, options.host)
    tls = None
    if options.tls_cert is not None:
        tls = ssl.create_default_context()
        # The certificate names another host than this address, and only the greeting is read.
        tls.check_hostname = False
        tls.verify_mode = ssl.CERT_NONE
    shown = f"[{host}]" if ":" in host else host
    url = f"ws{'s' if tls else ''}://{shown}:{options.port}/"
    cure = "stop it before you start another, or choose another --port"
    try:
        async with (
            asyncio.timeout(ASK_S),
            connect(url, name="doctor", role="observer", tls=tls) as client,
        ):
            version = client.welcome["service"]["version"]
            return Finding("port", "note", f"{address}: hapticvlm {version} runs there", cure)
    except Refused:
        reason = (
            f"{address}: a hapticvlm runs there, which wants a token or speaks another protocol"
        )
        return Finding("port", "note", reason, cure)
    except Exception as error:  # noqa: BLE001 - an unknown program may answer anything
        reason = f"{address}: another program has it ({type(error).__name__})"
        return Finding("port", "wrong", reason, "choose another --port")
