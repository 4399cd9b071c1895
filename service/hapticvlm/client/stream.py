"""Sends a recorded capture to a service at its own pace, and keeps what came back.

Frames go out at their recorded times, never waiting for answers; when the service is slower it says
so with `skipped`. As fast as possible means: the next frame as soon as the last is answered.
"""

from __future__ import annotations

import asyncio
import json
import ssl
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from websockets.exceptions import InvalidURI, WebSocketException

from hapticvlm.captures import Capture, CaptureError, Line, read
from hapticvlm.client.connection import Client, Message, Refused, connect, trusting

ANSWER_S = 5.0


@dataclass(slots=True)
class Outcome:
    """What came back of one stream: counts of answers, and (line, answer) in order."""

    sent: Counter[str] = field(default_factory=Counter)
    answers: Counter[str] = field(default_factory=Counter)
    unanswered: int = 0
    seconds: float = 0.0


Seen = Callable[[Line, Message], None]


async def stream(
    client: Client,
    capture: Capture,
    *,
    seen: Seen,
    fast: bool = False,
    with_masks: bool = True,
) -> Outcome:
    """Send every line of the capture; `seen` is told each answer as it arrives."""
    outcome = Outcome()
    waiting: set[asyncio.Future[Message]] = set()
    started = time.monotonic()

    def keep(line: Line, future: asyncio.Future[Message]) -> None:
        waiting.discard(future)
        if future.cancelled() or future.exception() is not None:
            return
        answer = future.result()
        reason = answer.get("reason") or answer.get("code")
        outcome.answers[answer["type"] + (f" {reason}" if reason else "")] += 1
        seen(line, answer)

    for line in capture.lines():
        if not fast:
            await asyncio.sleep(max(0.0, started + line.t_s - time.monotonic()))
        fields: dict[str, Any] = line.message(with_mask=with_masks)
        if "captured_at" in fields:
            fields["captured_at"] = started + line.t_s if not fast else time.monotonic()
        future = await client.send(line.type, **fields)
        outcome.sent[line.type] += 1
        waiting.add(future)
        future.add_done_callback(lambda future, line=line: keep(line, future))  # type: ignore[misc]
        if fast:
            await asyncio.wait({future}, timeout=ANSWER_S)
    if waiting:
        await asyncio.wait(waiting, timeout=ANSWER_S)
    await asyncio.sleep(0)
    outcome.unanswered = len(waiting)
    outcome.seconds = time.monotonic() - started
    return outcome


@dataclass(frozen=True, slots=True)
class Target:
    """The service to send to; `ca` is the authority to trust for wss, a PEM file."""

    url: str
    token: str | None = None
    ca: Path | None = None


def run(path: Path, to: Target, *, fast: bool, with_masks: bool, as_json: bool) -> int:
    """Stream one capture, showing progress, decisions as they change and a summary."""
    try:
        tls = None if to.ca is None else trusting(to.ca)
    except OSError as error:
        print(f"hapticvlm stream: --ca {to.ca}: {error.strerror}", file=sys.stderr)
        return 2
    service = partial(connect, to.url, name="hapticvlm stream", token=to.token, tls=tls)
    try:
        return asyncio.run(_run(read(path), service, fast, with_masks, as_json))
    except (CaptureError, Refused) as error:
        print(f"hapticvlm stream: {error}", file=sys.stderr)
    except (OSError, WebSocketException, ValueError) as error:
        print(f"hapticvlm stream: {to.url}: {error}; {_hint(error)}", file=sys.stderr)
    return 2


def _hint(error: Exception) -> str:
    if isinstance(error, ssl.SSLCertVerificationError):
        return "give the authority that signed its certificate with --ca FILE"
    if isinstance(error, (InvalidURI, ValueError)):
        return "a service is ws://HOST:PORT/ or, with a certificate, wss://HOST:PORT/"
    if isinstance(error, (ssl.SSLError, WebSocketException)):
        return "is it a service, and ws:// or wss:// as its ready line says?"
    return "start a service with `hapticvlm serve`"


async def _run(
    capture: Capture,
    service: Callable[[], AbstractAsyncContextManager[Client]],
    fast: bool,
    with_masks: bool,
    as_json: bool,
) -> int:
    console = Console(stderr=as_json)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    shown: dict[str | None, str] = {}
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(capture.path.name, total=capture.frames)

        def seen(line: Line, answer: Message) -> None:
            if line.type == "frame":
                progress.advance(task)
            if answer["type"] == "error":
                progress.console.print(f"[red]{line.t_s:7.2f} s  {answer['text']}")
            if answer["type"] != "decision":
                return
            if as_json:
                print(json.dumps({"t_s": line.t_s, "truth": line.truth, **answer}), flush=True)
                return
            object_id, said = answer.get("object_id"), describe(answer)
            if shown.get(object_id) != said:
                shown[object_id] = said
                progress.console.print(f"{line.t_s:7.2f} s  {said}", highlight=False)

        async with service() as client:
            outcome = await stream(client, capture, seen=seen, fast=fast, with_masks=with_masks)
    console.print(_summary(outcome), highlight=False)
    return 1 if outcome.unanswered or any("error" in name for name in outcome.answers) else 0


def describe(decision: Message) -> str:
    """One line for a person: object, material, confidence, rung, setpoint."""
    limited = f" (limited by {decision['limited_by']})" if decision.get("limited_by") else ""
    return (
        f"{decision.get('object_id') or 'the view':<22} {decision['material']:<8} "
        f"{decision['confidence']:4.0%} from {decision['source']:<8} "
        f"plate {decision['setpoint_c']:5.1f} degC{limited}"
    )


def _summary(outcome: Outcome) -> str:
    sent = ", ".join(f"{count} {name}" for name, count in outcome.sent.items())
    answers = ", ".join(f"{count} {name}" for name, count in sorted(outcome.answers.items()))
    return (
        f"sent {sent} in {outcome.seconds:.1f} s; "
        f"answered: {answers}; unanswered: {outcome.unanswered}"
    )
