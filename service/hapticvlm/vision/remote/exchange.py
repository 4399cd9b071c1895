"""Sends requests to a shared recogniser over one kept connection and returns response bodies."""

from __future__ import annotations

import http
import json

from hapticvlm.http_client import Address, HttpClient, HttpError, printable
from hapticvlm.vision.remote.contract import MAX_ANSWER_BYTES, MESSAGEPACK


class Exchange:
    """A connection that is opened when needed and then kept; used by one thread."""

    def __init__(self, address: Address, token: str | None) -> None:
        self._client = HttpClient(address, token, MESSAGEPACK, MAX_ANSWER_BYTES)

    def ask(self, verb: str, path: str, body: bytes | None, deadline: float) -> bytes:
        """Return the body of the response; `deadline` is a time.monotonic, s. Raises HttpError."""
        response = self._client.request(verb, path, body, deadline)
        if response.status != http.HTTPStatus.OK:
            problem = f"HTTP {response.status}: {_reason(response.body)}{_cure(response.status)}"
            raise HttpError(self._client.redacted(problem))
        return response.body

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        self._client.close()


def _cure(status: int) -> str:
    is_refused = status in (http.HTTPStatus.UNAUTHORIZED, http.HTTPStatus.FORBIDDEN)
    return "; its token is read from HAPTICVLM_RECOGNISER_TOKEN" if is_refused else ""


def _reason(data: bytes) -> str:
    try:
        text = json.loads(data)["error"]
    except (ValueError, KeyError, TypeError, RecursionError):
        text = data[:400].decode("utf-8", "replace")
    return printable(str(text)) or "no message"
