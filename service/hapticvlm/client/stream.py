"""`hapticvlm stream` sends a capture to a service and prints its decisions.

It prints a table for a person, or JSON lines for a program. `sending.py` sends.
"""

from __future__ import annotations

import asyncio
import json
import ssl
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from websockets.exceptions import InvalidURI, WebSocketException

from hapticvlm.captures import Capture, CaptureError, Line
from hapticvlm.client.connection import Client, Message, Refused, connect, trusting
from hapticvlm.client.sending import Outcome, stream
from hapticvlm.errors import HapticVLMError, network_reason

LATE_S = 0.25  # a shorter delay is not reported
COLUMNS = (
    TextColumn("{task.description}"),
    BarColumn(),
    MofNCompleteColumn(),
    TimeElapsedColumn(),
)


class StreamError(HapticVLMError):
    """Raised when the service was not reached, or closed the connection."""


@dataclass(frozen=True, slots=True)
class Target:
    """The service to send to; `ca` is the authority to trust for wss, a PEM file."""

    url: str
    token: str | None = None
    ca: Path | None = None


def run(opened: Callable[[], Capture], to: Target, *, as_json: bool) -> int:
    """Stream one capture; print progress, decisions as they change and a summary.

    Returns 0, or 1 where a message had no answer or was refused. Raises CaptureError, Refused, and
    StreamError where no service is reached.
    """
    try:
        tls = None if to.ca is None else trusting(to.ca)
    except OSError as error:
        raise StreamError(f"--ca {to.ca}: {error.strerror}") from None
    service = partial(connect, to.url, name="hapticvlm stream", token=to.token, tls=tls)
    try:
        return asyncio.run(_run(opened(), service, as_json=as_json))
    except (CaptureError, Refused):
        raise
    except (OSError, WebSocketException, ValueError) as error:
        reason = network_reason(error)
        raise StreamError(f"{to.url}: {reason}; {_hint(error)}") from error


def describe(decision: Message) -> str:
    """Return a line for a person: object, material, confidence, rung, setpoint."""
    surface = decision.get("surface")
    place = f"{decision.get('object_id') or 'the view'}{'' if surface is None else f', {surface}'}"
    limited = f" (limited by {decision['limited_by']})" if decision.get("limited_by") else ""
    return (
        f"{place:<22} {decision['material']:<8} "
        f"{decision['confidence']:4.0%} from {decision['source']:<8} "
        f"plate {decision['setpoint_c']:5.1f} degC{limited}"
    )


def _hint(error: Exception) -> str:
    if isinstance(error, ssl.SSLCertVerificationError):
        return "give the authority that signed its certificate: --ca FILE"
    if isinstance(error, (InvalidURI, ValueError)):
        return "the address must be ws://HOST:PORT/ or, with a certificate, wss://HOST:PORT/"
    if isinstance(error, (ssl.SSLError, WebSocketException)):
        return "use the address, ws:// or wss://, that `hapticvlm serve` prints"
    return "start a service with `hapticvlm serve`"


async def _run(
    capture: Capture,
    service: Callable[[], AbstractAsyncContextManager[Client]],
    *,
    as_json: bool,
) -> int:
    console = Console(stderr=as_json)
    with Progress(*COLUMNS, console=console) as progress:
        show = _Show(progress, capture, as_json=as_json)
        async with service() as client:
            outcome = await stream(client, capture, seen=show.seen)
    console.print(_summary(outcome), highlight=False)
    return 1 if outcome.unanswered or any("error" in name for name in outcome.answers) else 0


class _Show:
    """Prints each changed decision, each error once, and a progress bar."""

    def __init__(self, progress: Progress, capture: Capture, *, as_json: bool) -> None:
        self._progress = progress
        self._task = progress.add_task(capture.path.name, total=capture.frames or None)
        self._as_json = as_json
        self._shown: dict[tuple[str | None, int | None], tuple[str, str]] = {}
        self._errors: set[str] = set()

    def seen(self, line: Line, answer: Message) -> None:
        """Receive the answer to a line."""
        if line.type == "frame":
            self._progress.advance(self._task)
        if answer["type"] == "error" and answer["text"] not in self._errors:
            self._errors.add(answer["text"])
            self._print(f"[red]{line.t_s:7.2f} s  {answer['text']}")
        if answer["type"] == "decision":
            self._decided(line, answer)

    def _decided(self, line: Line, answer: Message) -> None:
        if self._as_json:
            print(json.dumps({"t_s": line.t_s, "truth": line.truth, **answer}), flush=True)
            return
        place = (answer.get("object_id"), answer.get("surface"))
        change = (answer["material"], answer["source"])
        if self._shown.get(place) != change:
            self._shown[place] = change
            self._print(f"{line.t_s:7.2f} s  {describe(answer)}")

    def _print(self, text: str) -> None:
        self._progress.console.print(text, highlight=False)


def _summary(outcome: Outcome) -> str:
    sent = ", ".join(f"{count} {name}" for name, count in outcome.sent.items())
    answers = ", ".join(f"{count} {name}" for name, count in sorted(outcome.answers.items()))
    late = f"; frames were up to {outcome.late_s:.1f} s late" if outcome.late_s > LATE_S else ""
    return (
        f"sent {sent} in {outcome.seconds:.1f} s; "
        f"answered: {answers}; unanswered: {outcome.unanswered}{late}"
    )
