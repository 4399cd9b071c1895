"""What `hapticvlm doctor` finds: a verdict, what was seen, and what to do."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "note", "wrong"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One line: wrong = what was asked for will not work, note = worth knowing."""

    about: str
    verdict: Verdict
    message: str
    cure: str | None = None


class BackgroundCheck:
    """A check that may hang, in a thread that nobody has to wait for."""

    def __init__(self, about: str, check: Callable[[], list[Finding]]) -> None:
        self._about = about
        self._found: list[Finding] = []
        self._thread = threading.Thread(target=self._run, args=(check,), daemon=True)
        self._thread.start()

    def _run(self, check: Callable[[], list[Finding]]) -> None:
        self._found = check()

    def by(self, deadline: float) -> list[Finding]:
        """Return what was found, or at `deadline` (monotonic, s) that there was no answer."""
        self._thread.join(max(0.0, deadline - time.monotonic()))
        if self._thread.is_alive() or not self._found:
            return [Finding(self._about, "note", "no answer in time", "try it again")]
        return self._found
