"""One kept connection to a shared recogniser: a request and the body of its response."""

from __future__ import annotations

import http
import json

from hapticvlm.http_client import Address, HttpClient, HttpError, printable
from hapticvlm.vision.remote.contract import MAX_ANSWER_BYTES, MESSAGEPACK


class Exchange:
    """Opens the connection when it is needed and keeps it. For one thread."""

    def __init__(self, address: Address, token: str | None) -> None:
        self._client = HttpClient(address, token, MESSAGEPACK, MAX_ANSWER_BYTES)

    def ask(self, verb: str, path: str, body: bytes | None, deadline: float) -> bytes:
        """Return the body of the response. Raises HttpError, whatever goes wrong."""
        response = self._client.request(verb, path, body, deadline)
        if response.status != http.HTTPStatus.OK:
            text = f"HTTP {response.status}: {_reason(response.body)}"
            raise HttpError(self._client.redacted(text))
        return response.body

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        self._client.close()


def _reason(data: bytes) -> str:
    try:
        text = json.loads(data)["error"]
    except (ValueError, KeyError, TypeError, RecursionError):
        text = data[:400].decode("utf-8", "replace")
    return printable(str(text)) or "no message"
