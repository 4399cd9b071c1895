"""`hapticvlm stream` sends a capture to a service and prints its decisions.

It prints a table for a person, or JSON lines for a program. `sending.py` sends.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hapticvlm.captures import Capture, Line
from hapticvlm.client.connection import Client, Message
from hapticvlm.client.sending import Outcome, stream

LATE_S = 0.25  # a shorter delay is not reported
COLUMNS = (
    TextColumn("{task.description}"),
    BarColumn(),
    MofNCompleteColumn(),
    TimeElapsedColumn(),
)


def run(
    capture: Capture, service: Callable[[], AbstractAsyncContextManager[Client]], *, as_json: bool
) -> int:
    """Stream one capture; print progress, decisions as they change and a summary.

    Returns 0, or 1 where a message had no answer or was refused. Raises CaptureError, Refused,
    OSError and WebSocketException.
    """
    return asyncio.run(_run(capture, service, as_json=as_json))


async def _run(
    capture: Capture, service: Callable[[], AbstractAsyncContextManager[Client]], *, as_json: bool
) -> int:
    console = Console(stderr=as_json)
    with Progress(*COLUMNS, console=console) as progress:
        show = _Show(progress, capture, as_json=as_json)
        async with service() as client:
            outcome = await stream(client, capture, seen=show.seen)
    console.print(_summary(outcome), highlight=False)
    return 1 if outcome.unanswered or any("error" in name for name in outcome.answers) else 0


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
