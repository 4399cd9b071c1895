"""The log as observers see it."""

from __future__ import annotations

import logging

from hapticvlm.server.gateway import Gateway


class ObserverLog(logging.Handler):
    """Passes log lines to the observers that watch the log; used on the event loop's thread."""

    def __init__(self, gateway: Gateway) -> None:
        super().__init__()
        self._gateway = gateway

    def emit(self, record: logging.LogRecord) -> None:
        """Show one line."""
        self._gateway.show_log(self.format(record))
