"""A finding of `hapticvlm doctor`: a verdict, a message, and how to fix it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "note", "wrong"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report: `wrong` means that the service would not run as its options say.

    `note` is worth knowing; `cure` says what to do.
    """

    about: str
    verdict: Verdict
    message: str
    cure: str | None = None


class BackgroundCheck:
    """Runs a check that may hang in a daemon thread, so that the program can end without it."""

    def __init__(self, about: str, check: Callable[[], list[Finding]]) -> None:
        self._about = about
        self._findings: list[Finding] = []
        self._thread = threading.Thread(target=self._run, args=(check,), daemon=True)
        self._thread.start()

    def _run(self, check: Callable[[], list[Finding]]) -> None:
        self._findings = check()

    def by(self, deadline: float) -> list[Finding]:
        """Wait until `deadline` (monotonic, s); return the findings, or a note of no answer."""
        self._thread.join(max(0.0, deadline - time.monotonic()))
        if self._thread.is_alive() or not self._findings:
            return [Finding(self._about, "note", "no answer in time", "try again")]
        return self._findings
