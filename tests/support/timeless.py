"""An event loop on which minutes pass at once."""

import asyncio
import selectors


class Waits(selectors.SelectSelector):
    """Waits for nothing: it lets the loop's time pass."""

    now = 0.0

    def select(self, timeout=None):
        self.now += timeout or 0.0
        return []


class TimelessLoop(asyncio.SelectorEventLoop):
    """An event loop whose time passes only while it waits."""

    def __init__(self):
        self.waits = Waits()
        super().__init__(self.waits)

    def time(self):
        return self.waits.now
