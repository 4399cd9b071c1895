"""Sends a request to a chat endpoint and reads its answer, within a time and a size.

Plain http is used only if the user's own URL has it; pictures then travel in clear text. A token is
never sent in clear text, except to this machine. Knows no model.
"""

from __future__ import annotations

import http
import json
import re
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import urlsplit

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
CHAT = "/chat/completions"
MODELS = "/models"
_VERSION = re.compile(r"/v\d")
_VERSION_QUERY = re.compile(r"api-version=[\w.-]+")
_RETRY_DELAY = re.compile(rb'"retryDelay"\s*:\s*"([\d.]+)s"')  # of Google's error bodies
_FORMS = {  # of answers that are not JSON, by their begin
    b"\x1f\x8b": "compressed, although asked not to be",
    b"data:": "a stream, although asked not to be",
    b":": "a stream, although asked not to be",
    b"event:": "a stream, although asked not to be",
}
_CURES = {  # by what an error says, the first that fits
    "HTTP 404": f"asked was {{url}}: check {FLAG}",
    "HTTP 40[13]|API key": "HAPTICVLM_VLM_TOKEN holds {token} token, --vlm-header names its header",
    "context|too long|maximum (model )?length|HTTP 413|tokens.* must be": (
        "a smaller --image-tokens makes the pictures shorter"
    ),
    "CERTIFICATE_VERIFY_FAILED": "name the file of its own certificate in SSL_CERT_FILE",
    "WRONG_VERSION_NUMBER|record layer": f"it seems to speak http: give {FLAG} http://...",
    "to (an )?HTTPS port": f"give {FLAG} https://...",
}
_HEADER = re.compile(r"[A-Za-z][A-Za-z0-9-]{0,63}")


class EndpointError(VlmError):
    """The endpoint gave no usable answer. `status`: of HTTP; `wait_s`: its Retry-After."""

    def __init__(self, text: str, status: int | None = None, wait_s: float | None = None) -> None:
        super().__init__(text)
        self.status = status
        self.wait_s = wait_s


def judge(response: Response) -> Json:
    """Read the JSON object of a response. Raises EndpointError."""
    status = response.status
    data = response.body
    if 300 <= status < 400:
        problem = f"the endpoint redirects (HTTP {status}) to {response.target or 'nowhere'}"
        raise EndpointError(f"{problem}; give its target", status)
    if status != http.HTTPStatus.OK:
        problem = f"the endpoint answers HTTP {status}: {_error_text(data) or 'no message'}"
        delay = _RETRY_DELAY.search(data)
        wait_s = float(delay[1]) if response.wait_s is None and delay else response.wait_s
        raise EndpointError(problem, status, wait_s)
    for begin, form in _FORMS.items():
        if data.lstrip().startswith(begin):
            raise EndpointError(f"the endpoint's answer is not JSON but {form}", status)
    try:
        answer = json.loads(data, parse_constant=_refuse)
    except (ValueError, RecursionError):
        problem = f"the endpoint's answer is not JSON: {_decoded(data)}"
        raise EndpointError(problem, status) from None
    if not isinstance(answer, dict):
        raise EndpointError("the endpoint's answer is JSON, but not an object", status)
    if answer.get("error"):
        raise EndpointError(f"the endpoint reports: {_error_text(data)}", status)
    return answer


def _error_text(data: bytes) -> str:
    """Return the message of an error body, as OpenAI's, Google's and FastAPI's endpoints do."""
    try:
        body = json.loads(data)
        body = body[0] if isinstance(body, list) else body
        message = body.get("error") or body.get("detail") or body.get("message")
    except (ValueError, RecursionError, AttributeError, IndexError):
        return _decoded(data)
    if isinstance(message, dict):
        message = message.get("message", message)
    return printable(str(message)) if message else _decoded(data)


def _refuse(name: str) -> float:
    raise ValueError(f"{name} is not JSON")


def _decoded(data: bytes) -> str:
    return printable(data[: 4 * MAX_QUOTED_CHARS].decode("utf-8", "replace"))


def read_address(url: str) -> Address:
    """Parse an endpoint's URL. Raises VlmError or HttpError.

    It is taken as written, with or without /chat/completions at its end. Only where it has no
    version, /v1 is added. The one query it may have is Azure's api-version.
    """
    written, mark, query = url.partition("?")
    if mark and not _VERSION_QUERY.fullmatch(query):
        problem = f"{FLAG}: only ?api-version= may follow ?, and no #"
        raise VlmError(f"{problem}; a key is given in HAPTICVLM_VLM_TOKEN")
    base = written.rstrip("/").removesuffix(CHAT)
    address = http_client.read_address(base, FLAG)
    path = urlsplit(base).path.rstrip("/")
    has_version = bool(mark) or _VERSION.search(path) is not None
    return replace(address, path=path if has_version else f"{path}/v1", query=mark + query)


@dataclass(frozen=True, slots=True)
class Endpoint:
    """An address and the bearer token sent to it. Deadlines are times of `time.monotonic`, s."""

    address: Address
    token: str | None = field(repr=False)
    header: str | None = None

    def post(self, path: str, body: Json, deadline: float) -> Json:
        """Post a JSON body and return the answer's object. Raises EndpointError."""
        return self._send("POST", path, json.dumps(body).encode(), deadline)

    def get(self, path: str, deadline: float) -> Json:
        """Get a path and return the answer's object. Raises EndpointError."""
        return self._send("GET", path, None, deadline)

    def _send(self, verb: str, path: str, body: bytes | None, deadline: float) -> Json:
        client = HttpClient(self.address, self.token, "application/json", ANSWER_BYTES, self.header)
        with closing(client):  # requests are seconds apart, so no connection is kept
            try:
                return judge(client.request(verb, path, body, deadline))
            except HttpError as error:
                problem = EndpointError(f"{self.address.name}: {error}")
            except EndpointError as error:
                problem = error
            text = client.redacted(str(problem))
            url = printable(client.url_of(path))
        cures = (cure for cause, cure in _CURES.items() if re.search(cause, text, re.IGNORECASE))
        if cure := next(cures, ""):
            text += "; " + cure.format(url=url, token="another" if self.token else "no")
        raise EndpointError(text, problem.status, problem.wait_s)


def endpoint_at(url: str, token: str | None, header: str | None) -> Endpoint:
    """Return the endpoint of a URL. Raises VlmError, whose message does not repeat the token."""
    if header is not None and not _HEADER.fullmatch(header):
        raise VlmError("--vlm-header is the name of a header, like api-key; letters, digits and -")
    try:
        address = read_address(url)
        return Endpoint(address, http_client.check_token(token, address, FLAG), header)
    except HttpError as error:
        raise VlmError(str(error)) from None
