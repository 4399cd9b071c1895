"""Gives `Client` to programs without await, such as a notebook: `hapticvlm.connect_blocking`.

An event loop in a thread of its own runs the same client; each method here hands it one call and
waits for the result.
"""

from __future__ import annotations

import asyncio
import ssl
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Any, Self, TypeVar

from websockets.exceptions import ConnectionClosed

from hapticvlm.client.connection import URL, Client, Hand, Message, connect
from hapticvlm.errors import HapticVLMError

_Result = TypeVar("_Result")
CLOSE_S = 10.0  # a service that is gone is not waited for any longer


class BlockingClient:
    """An open connection; `hapticvlm.connect_blocking` returns one.

    Use it in a `with` statement, or call `close`. The methods have the parameters and errors of
    `hapticvlm.Client`, and may be called from any thread.
    """

    def __init__(
        self, url: str, name: str, role: str, token: str | None, tls: ssl.SSLContext | None
    ) -> None:
        self._loop = asyncio.new_event_loop()
        # A daemon, so that a program that forgets to close can still end.
        self._thread = threading.Thread(target=self._loop.run_forever, name=name, daemon=True)
        self._thread.start()
        self._connection = connect(url, name=name, role=role, token=token, tls=tls)
        try:
            self._client: Client = self._run(self._connection.__aenter__())
        except BaseException:
            self._end()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def welcome(self) -> Message:
        """The service's answer to hello, with its limits, devices, models and materials."""
        return self._client.welcome

    def request(self, type: str, **fields: Any) -> Message:
        """Send one message and return its answer. Raises `Refused`."""
        return self._run(self._client.request(type, **fields))

    def scene(self, objects: list[Message], *, replace: bool = True, **fields: Any) -> Message:
        """Declare the objects of the scene, as `Client.scene` does."""
        return self._run(self._client.scene(objects, replace=replace, **fields))

    def frame(self, image: bytes, width: int, height: int, **fields: Any) -> Message:
        """Send a picture and return `decision` or `skipped`, as `Client.frame` does."""
        return self._run(self._client.frame(image, width, height, **fields))

    def touch(self, phase: str, object_id: str | None = None, **fields: Any) -> Message:
        """Send the state of a hand once, as `Client.touch` does; `touching` also renews it."""
        return self._run(self._client.touch(phase, object_id, **fields))

    def set(self, **fields: Any) -> Message:
        """Change settings of this session, as `Client.set` does."""
        return self._run(self._client.set(**fields))

    def stop(self, scope: str = "all") -> Message:
        """Stop the outputs at once, as `Client.stop` does."""
        return self._run(self._client.stop(scope))

    @contextmanager
    def touching(self, object_id: str, **fields: Any) -> Iterator[Hand]:
        """Touch an object until the block ends, as `Client.touching` does.

        The thread of the connection renews the lease, so the block may compute or sleep. For the
        same reason a block that hangs goes on touching, but for no longer than `longest_s`. When
        this process dies or is paused, the renewals end, and the lease with them.

            with client.touching("cup", speed_mps=0.2):
                time.sleep(2.0)
        """
        touching = self._client.touching(object_id, **fields)
        hand = self._run(touching.__aenter__())
        try:
            yield hand
        except BaseException:
            # The error stays in the caller's thread: Ctrl-C, thrown into the loop, would end it.
            with suppress(HapticVLMError, OSError, ConnectionClosed):
                self._run(touching.__aexit__(None, None, None))
            raise
        self._run(touching.__aexit__(None, None, None))

    def events(self) -> list[Message]:
        """Return the events since the last call, such as `decision` and `telemetry`."""
        return self._run(self._drain())

    def next_event(self, type: str, *, seconds: float = 10.0) -> Message:
        """Wait for the next event of this type, drop those before it, and return it.

        Raises TimeoutError after `seconds`.
        """
        return self._run(self._wait_for(type, seconds))

    def close(self) -> None:
        """Close the connection; outputs that it owned come to rest. A second call does nothing."""
        if self._loop.is_closed():
            return
        try:
            self._run(self._connection.__aexit__(None, None, None), CLOSE_S)
        finally:
            self._end()

    def _run(self, call: Coroutine[Any, Any, _Result], seconds: float | None = None) -> _Result:
        if self._loop.is_closed():
            call.close()
            raise ConnectionError("this connection is closed; open another")
        future = asyncio.run_coroutine_threadsafe(call, self._loop)
        try:
            return future.result(seconds)
        except BaseException:  # Ctrl-C in the caller's thread ends the call, too
            future.cancel()
            raise

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(CLOSE_S)
        if not self._thread.is_alive():
            self._loop.close()

    async def _drain(self) -> list[Message]:
        events = self._client.events
        return [events.get_nowait() for _ in range(events.qsize())]

    async def _wait_for(self, type: str, seconds: float) -> Message:
        async with asyncio.timeout(seconds):
            while (event := await self._client.events.get())["type"] != type:
                pass
        return event


def connect_blocking(
    url: str = URL,
    *,
    name: str = "hapticvlm-python",
    role: str = "scene",
    token: str | None = None,
    tls: ssl.SSLContext | None = None,
) -> BlockingClient:
    """Open a connection to a service, for a program or a notebook without await.

    Parameters and errors are those of `hapticvlm.connect`: Raises `Refused` and OSError.

        with hapticvlm.connect_blocking() as client:
            client.scene([{"object_id": "cup", "material": "ceramic", "temperature_c": 50.0}])
            with client.touching("cup"):
                time.sleep(2.0)
    """
    return BlockingClient(url, name, role, token, tls)
