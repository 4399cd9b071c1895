"""What an endpoint's HTTP reply is worth: its JSON object, or what is wrong with it. Pure."""

from __future__ import annotations

import http
import json
import math
from typing import Any

from hapticvlm.recognition.vlm.answers import VlmError

MOST_TEXT = 200  # characters of an endpoint's own words that an error repeats

Json = dict[str, Any]


class EndpointError(VlmError):
    """The endpoint gave no answer of use. `status` is its HTTP status, `wait_s` its Retry-After."""

    def __init__(self, text: str, status: int | None = None, wait_s: float | None = None) -> None:
        super().__init__(text)
        self.status, self.wait_s = status, wait_s


def judge(status: int, retry_after: str | None, data: bytes) -> Json:
    """Take the JSON object out of a reply. Raises EndpointError."""
    if 300 <= status < 400:
        raise EndpointError(f"the endpoint redirects (HTTP {status}): name its goal", status)
    if status != http.HTTPStatus.OK:
        text = f"the endpoint answers HTTP {status}: {_own_words(data) or 'no word why'}"
        raise EndpointError(text, status, _wait_s(retry_after))
    try:
        answer = json.loads(data, parse_constant=_refuse)
    except (ValueError, RecursionError):
        text = f"the endpoint's answer is no JSON: {_decoded(data)}"
        raise EndpointError(text, status) from None
    if not isinstance(answer, dict):
        raise EndpointError("the endpoint's answer is JSON, but no object", status)
    if answer.get("error"):
        raise EndpointError(f"the endpoint says: {_own_words(data)}", status)
    return answer


def printable(text: str) -> str:
    """Cut foreign words short and drop what could forge a line of a log."""
    clean = "".join(c if c.isprintable() else " " for c in text[: 4 * MOST_TEXT])
    clean = " ".join(clean.split())
    return clean if len(clean) <= MOST_TEXT else clean[:MOST_TEXT] + "..."


def _own_words(data: bytes) -> str:
    """Find the message of an error body, as OpenAI's and FastAPI's endpoints spell it."""
    try:
        found = json.loads(data)
        said = found.get("error") or found.get("detail") or found.get("message")
    except (ValueError, RecursionError, AttributeError):
        return _decoded(data)
    if isinstance(said, dict):
        said = said.get("message", said)
    return printable(str(said)) if said else _decoded(data)


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
    return printable(data[: 4 * MOST_TEXT].decode("utf-8", "replace"))
