"""The user's certificate: loaded, tried once in memory, described. Knows neither ports nor clients.

The standard library hides names and last day of a certificate that it loads. They are learned from
a handshake of the certificate with itself, through two buffers in memory.
"""

from __future__ import annotations

import logging
import os
import ssl
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hapticvlm import documents

# X509_V_ERR_* of OpenSSL
_EXPIRED = 10
_NOT_YET = 9
_ROUNDS = 8  # a handshake takes three

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Certificate:
    """One that can be served: the names and addresses it is for, and its end in Unix seconds."""

    context: ssl.SSLContext
    names: frozenset[str]
    ends_at: float


def load(certificate: Path, key: Path) -> Certificate:
    """Return a certificate in PEM and its key, ready to be served with TLS 1.2 or later.

    Raises ValueError that names the flag, the file and what to do.
    """
    _require(certificate, "--tls-cert", "BEGIN CERTIFICATE", "certificate")
    text = _require(key, "--tls-key", "PRIVATE KEY", "private key")
    if "ENCRYPTED" in text:
        raise ValueError(
            f"--tls-key {key}: locked with a passphrase; write it without: openssl pkey -in ... "
            "-out ..."
        )
    if os.name == "posix" and key.stat().st_mode & 0o077:
        logger.warning("--tls-key %s: others can read it: chmod 600 %s", key, key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            raise ValueError(f"--tls-key {key}: belongs to another than {certificate}") from None
        raise ValueError(f"--tls-cert {certificate}: can't be used: {_reason(error)}") from None
    return _examined(context, certificate)


def _require(path: Path, flag: str, mark: str, what: str) -> str:
    """Return the text of a PEM file that holds such a thing. Raises ValueError."""
    try:
        text = documents.read_bytes(path, documents.MIB).decode("ascii", errors="replace")
    except (OSError, ValueError) as error:
        raise ValueError(f"{flag} {path}: {documents.reason(error)}") from None
    if mark not in text:
        raise ValueError(f"{flag} {path}: holds no {what} in PEM ('-----BEGIN ...')")
    return text


def _examined(context: ssl.SSLContext, file: Path) -> Certificate:
    """Shake hands with ourselves as a client that trusts this one certificate."""
    client = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False
    client.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    client.load_verify_locations(file)
    try:
        presented = _shake_hands(client, context)
    except ssl.SSLCertVerificationError as error:
        cure = "; make a new one" if error.verify_code in (_EXPIRED, _NOT_YET) else ""
        text = f"--tls-cert {file}: no client would take it: {error.verify_message}{cure}"
        raise ValueError(text) from None
    except ssl.SSLError as error:
        raise ValueError(f"--tls-cert {file}: can't be used: {_reason(error)}") from None
    names = frozenset(name for _, name in presented.get("subjectAltName", ()))
    return Certificate(context, names, ssl.cert_time_to_seconds(presented["notAfter"]))


def _shake_hands(client: ssl.SSLContext, server: ssl.SSLContext) -> dict[str, Any]:
    """Return what the client learned of the server. Raises SSLError."""
    # Two ends of one handshake in memory, each reading what the other wrote: the standard library
    # tells the names and the last day of a certificate only to somebody it was presented to. It
    # also shows what a client would say to it, before the first one does.
    there = ssl.MemoryBIO()
    back = ssl.MemoryBIO()
    theirs = client.wrap_bio(back, there)
    ours = server.wrap_bio(there, back, server_side=True)
    for _ in range(_ROUNDS):
        for end in (theirs, ours):
            with suppress(ssl.SSLWantReadError):
                end.do_handshake()
    return dict(theirs.getpeercert() or {})


def _reason(error: ssl.SSLError) -> str:
    return (error.reason or str(error)).replace("_", " ").lower()
