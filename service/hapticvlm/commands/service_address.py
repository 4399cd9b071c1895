"""The options with which commands reach a running service: address, token, trusted authority.

It also turns the error of a service that is not reached, and of an address that cannot be listened
at, into one line.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.errors import UsageError, network_reason
from hapticvlm.server.addresses import ADDRESSES

if TYPE_CHECKING:
    from contextlib import AbstractAsyncContextManager

    from hapticvlm.client import Client

DEFAULT_URL = "ws://127.0.0.1:8790/"
_FORM = "must be ws://HOST:PORT/ or, with a certificate, wss://HOST:PORT/"


def add_url(parser: argparse.ArgumentParser) -> None:
    """Declare --url."""
    parser.add_argument(
        "--url", type=_address, default=DEFAULT_URL, help="address of the service (%(default)s)"
    )


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare --url, --token and --ca."""
    add_url(parser)
    parser.add_argument(
        "--token", help="token of the service (the environment variable HAPTICVLM_TOKEN)"
    )
    parser.add_argument(
        "--ca",
        type=Path,
        metavar="FILE",
        help="for wss://, trust the certificate authority in this PEM file",
    )


def connecting(
    options: argparse.Namespace, name: str, role: str = "scene"
) -> AbstractAsyncContextManager[Client]:
    """Return the connection to the service that the options name. Raises UsageError."""
    from hapticvlm.client import connect, trusting

    tls = None
    if options.ca is not None:
        try:
            tls = trusting(options.ca)
        except OSError as error:  # OpenSSL's own has no words for people
            reason = "has no certificate" if error.filename is None else error.strerror
            raise UsageError(f"--ca {options.ca}: {reason}; give a PEM file") from None
        if not options.url.startswith("wss:"):
            raise UsageError(f"--ca is for wss://, and --url is {options.url}")
    token = options.token or os.environ.get("HAPTICVLM_TOKEN")
    return connect(options.url, name=name, role=role, token=token, tls=tls)


@contextlib.contextmanager
def reaching(url: str, *, result: str = "") -> Iterator[None]:
    """Turn the error of a service that is not reached into a UsageError with its cure.

    `result` says what this command did not do because of it.
    """
    import ssl

    from websockets.exceptions import WebSocketException

    try:
        yield
    except (OSError, WebSocketException) as error:
        cure = "`hapticvlm serve` starts a service and prints its address"
        if isinstance(error, ssl.SSLCertVerificationError):
            cure = "give the authority that signed its certificate: --ca FILE"
        elif isinstance(error, (ssl.SSLError, WebSocketException)):  # something answered there
            cure = "use the address, ws:// or wss://, that `hapticvlm serve` prints"
        raise UsageError(f"{url}: {network_reason(error)}; {result}{cure}") from None


def _address(text: str) -> str:
    """Check the form of --url, as argparse calls it."""
    from websockets.exceptions import InvalidURI
    from websockets.uri import parse_uri

    try:
        parse_uri(text)
    except (InvalidURI, ValueError):
        raise argparse.ArgumentTypeError(f"{text}: {_FORM}") from None
    return text


@contextlib.contextmanager
def port_errors(port: int, host: str = "127.0.0.1") -> Iterator[None]:
    """Turn the error of an address that cannot be listened at into a UsageError with its cure."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            cause = "is in use (`hapticvlm doctor` shows by which program); stop that program, or"
            problem = f"port {port} {cause} use any free port: --port 0"
        elif error.errno == errno.EACCES and 0 < port < 1024:  # which root alone may use
            problem = f"port {port} is for the system; use one of 1024..65535"
        elif error.errno == errno.EADDRNOTAVAIL or isinstance(error, socket.gaierror):
            problem = f"--host {host}: {error.strerror}; {ADDRESSES}"
        else:
            raise
        raise UsageError(problem) from None
