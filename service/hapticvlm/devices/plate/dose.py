"""Dose and heat of a session, carried over resets of a board that forgets them. Pure."""

from __future__ import annotations

from dataclasses import dataclass

REST_S = 900.0  # without heat until a new session's heat may begin: our choice, as long as one


@dataclass(slots=True)
class Dose:
    """Thermal dose in CEM43 minutes and heat in seconds, as the board reports them and before."""

    _reported: tuple[float, float] = (0.0, 0.0)
    _carried: tuple[float, float] = (0.0, 0.0)
    _rested_since: float | None = None
    _is_restarted: bool = False

    @property
    def total(self) -> tuple[float, float]:
        """Dose and heat of the whole session."""
        return self._reported[0] + self._carried[0], self._reported[1] + self._carried[1]

    def update(self, dose_cem43: float, heated_s: float, now: float) -> None:
        """Update from the board's report; the report of its earlier run is dropped after a rest."""
        # A board that was reset by its watchdog keeps its dose in memory that survives, one that
        # lost its supply counts from zero. Both report one number. So after a reset what was known
        # before is added, unless the board's own count already contains it.
        is_remembered = dose_cem43 >= self._carried[0] and heated_s >= self._carried[1]
        if self._is_restarted and is_remembered:
            self._carried = (0.0, 0.0)
        self._is_restarted = False
        if heated_s > self._reported[1] or self._rested_since is None:
            self._rested_since = now
        elif now - self._rested_since >= REST_S:
            self._carried = (0.0, 0.0)
        self._reported = dose_cem43, heated_s

    def restart(self) -> None:
        """Keep what was reported so far: the board was reset and may count from zero."""
        self._carried = self.total
        self._reported = (0.0, 0.0)
        self._is_restarted = True
