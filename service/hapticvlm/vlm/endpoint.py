"""One question to a chat endpoint and its answer, within a time and a size. Knows no model.

Plain http is used only where the user's own url has it: pictures then travel in clear text. A
token does not, except to this machine.
"""

from __future__ import annotations

import http
import json
import math
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

from hapticvlm import http_client
from hapticvlm.http_client import (
    MAX_QUOTED_CHARS,
    Address,
    HttpClient,
    HttpError,
    Response,
    printable,
)
from hapticvlm.vlm.contract import VlmError
from hapticvlm.vlm.limits import ANSWER_BYTES

Json = dict[str, Any]

FLAG = "--vlm-url"


class EndpointError(VlmError):
    """The endpoint gave no answer of use. `status` is its HTTP status, `wait_s` its Retry-After."""

    def __init__(self, text: str, status: int | None = None, wait_s: float | None = None) -> None:
        super().__init__(text)
        self.status = status
        self.wait_s = wait_s


def judge(response: Response) -> Json:
    """Read the JSON object of a response. Raises EndpointError."""
    status = response.status
    data = response.body
    if 300 <= status < 400:
        raise EndpointError(f"the endpoint redirects (HTTP {status}): give its target", status)
    if status != http.HTTPStatus.OK:
        text = f"the endpoint answers HTTP {status}: {_error_text(data) or 'no message'}"
        raise EndpointError(text, status, _wait_s(response.retry_after))
    try:
        answer = json.loads(data, parse_constant=_refuse)
    except (ValueError, RecursionError):
        text = f"the endpoint's answer is no JSON: {_decoded(data)}"
        raise EndpointError(text, status) from None
    if not isinstance(answer, dict):
        raise EndpointError("the endpoint's answer is JSON, but no object", status)
    if answer.get("error"):
        raise EndpointError(f"the endpoint says: {_error_text(data)}", status)
    return answer


def _error_text(data: bytes) -> str:
    """Find the message of an error body, as OpenAI's and FastAPI's endpoints spell it."""
    try:
        found = json.loads(data)
        message = found.get("error") or found.get("detail") or found.get("message")
    except (ValueError, RecursionError, AttributeError):
        return _decoded(data)
    if isinstance(message, dict):
        message = message.get("message", message)
    return printable(str(message)) if message else _decoded(data)


def _wait_s(retry_after: str | None) -> float | None:
    """Seconds of a Retry-After header; None without one, or where it is a date or nonsense."""
    try:
        wait = float(retry_after or "")
    except ValueError:
        return None
    return wait if math.isfinite(wait) and wait >= 0 else None


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no JSON")


def _decoded(data: bytes) -> str:
    return printable(data[: 4 * MAX_QUOTED_CHARS].decode("utf-8", "replace"))


def read_address(url: str) -> Address:
    """Read an endpoint's url, with or without /v1 at its end. Raises VlmError."""
    try:
        return http_client.read_address(url, FLAG)
    except HttpError as error:
        raise VlmError(str(error)) from None


def check_token(token: str | None, address: Address) -> str | None:
    """Return a token that may be sent there. Raises VlmError, which does not repeat it."""
    try:
        return http_client.check_token(token, address, FLAG)
    except HttpError as error:
        raise VlmError(str(error)) from None


@dataclass(frozen=True, slots=True)
class Endpoint:
    """An address and the bearer token sent to it. Deadlines are times of `time.monotonic`, s."""

    address: Address
    token: str | None = field(repr=False)

    def post(self, path: str, body: Json, deadline: float) -> Json:
        """Ask with a JSON body. Raises EndpointError."""
        return self._asked("POST", path, json.dumps(body).encode(), deadline)

    def get(self, path: str, deadline: float) -> Json:
        """Ask without one. Raises EndpointError."""
        return self._asked("GET", path, None, deadline)

    def _asked(self, verb: str, path: str, body: bytes | None, deadline: float) -> Json:
        client = HttpClient(self.address, self.token, "application/json", ANSWER_BYTES)
        with closing(client):  # questions are seconds apart: no connection is kept
            try:
                return judge(client.request(verb, path, body, deadline))
            except HttpError as error:
                raise EndpointError(f"{self.address.name}: {error}") from None
            except EndpointError as error:
                text = client.redacted(str(error))
                raise EndpointError(text, error.status, error.wait_s) from None
