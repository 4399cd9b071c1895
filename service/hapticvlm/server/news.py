"""Turns the answers of a helper into news: its first failure, and its first answer after failures.

A helper is a model or a recogniser that the service asks again and again. One that refuses each
question would otherwise be known to the dashboard alone, while a scene waits for an answer that
never comes; and a report of each failure would drown everything else. A failure goes to the log and
to every connection, as an `error` with its cure. Good news goes to the log only: the protocol has
no event for it, and the answers themselves arrive. Pure.
"""

from __future__ import annotations

from dataclasses import dataclass

NEWS_S = 60.0  # between two reports on one helper, which may fail and answer in turns


@dataclass(frozen=True, slots=True)
class News:
    """A change of a helper, in words."""

    text: str
    is_good: bool


class HelperNews:
    """The news of one helper; nothing is news while it goes on failing, or answering."""

    def __init__(self) -> None:
        self._is_failing = False
        self._news: News | None = None
        self._reported_at = float("-inf")

    def note(self, name: str, error: str | None, now: float) -> None:
        """Note one answer of the helper of this name, or its error."""
        if (error is not None) == self._is_failing or now - self._reported_at < NEWS_S:
            return
        self._is_failing = error is not None
        self._reported_at = now
        text = f"{name} answers again" if error is None else f"{name} fails: {error}"
        self._news = News(text, is_good=error is None)

    def take(self) -> News | None:
        """Return the news since the last call, once."""
        news = self._news
        self._news = None
        return news
