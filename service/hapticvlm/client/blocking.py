"""Gives `Client` to programs without await, such as a notebook: `hapticvlm.connect_blocking`.

An event loop in a thread of its own runs the same client; each method here hands it one call and
waits for the result.
"""

from __future__ import annotations

import asyncio
import os
import ssl
import threading
import weakref
from collections.abc import Coroutine, Iterator
from contextlib import AbstractAsyncContextManager, contextmanager, suppress
from types import TracebackType
from typing import Any, Self, TypeVar

from websockets.exceptions import WebSocketException

from hapticvlm.client.connection import URL, Client, Disconnected, Hand, Message, connect, ended
from hapticvlm.errors import HapticVLMError, network_reason

_Result = TypeVar("_Result")
CLOSE_S = 10.0  # a service that is gone is not waited for any longer


class NoEvent(HapticVLMError, TimeoutError):
    """Raised when no event of the type came in time."""


class BlockingClient:
    """An open connection; `hapticvlm.connect_blocking` returns one.

    Use it in a `with` statement, or call `close`; one that is dropped closes by itself. The methods
    have the parameters and errors of `hapticvlm.Client`, all of them `HapticVLMError`, and may be
    called from any thread of the process that opened it.
    """

    def __init__(
        self, url: str, name: str, role: str, token: str | None, tls: ssl.SSLContext | None
    ) -> None:
        self._process = os.getpid()
        self._loop = asyncio.new_event_loop()
        # A daemon, so that a program that forgets to close can still end. Neither the thread nor
        # what it runs knows this object, so it can be dropped; then the connection is closed.
        self._thread = threading.Thread(target=_serve, args=(self._loop,), name=name, daemon=True)
        self._thread.start()
        self._connection = connect(url, name=name, role=role, token=token, tls=tls)
        self._end = weakref.finalize(
            self, _leave, self._process, self._loop, self._thread, self._connection
        )
        try:
            self._client: Client = self._run(self._connection.__aenter__())
        except (OSError, WebSocketException) as error:
            self._end()
            cure = "start one by `hapticvlm serve` or hapticvlm.serve()"
            raise Disconnected(f"no service at {url}: {network_reason(error)}; {cure}") from error
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
            with suppress(HapticVLMError):
                self._run(touching.__aexit__(None, None, None))
            raise
        self._run(touching.__aexit__(None, None, None))

    def events(self) -> list[Message]:
        """Return the events since the last call, such as `decision` and `telemetry`."""
        return self._run(self._drain())

    def next_event(self, type: str, *, seconds: float = 10.0) -> Message:
        """Wait for the next event of this type, drop those before it, and return it.

        Raises `NoEvent`, a TimeoutError, after `seconds`.
        """
        try:
            return self._run(self._wait_for(type, seconds))
        except TimeoutError:
            raise NoEvent(f"no event `{type}` within {seconds:g} s: wait for longer") from None

    def close(self) -> None:
        """Close the connection; outputs that it owned come to rest. A second call does nothing."""
        self._end()

    def _run(self, call: Coroutine[Any, Any, _Result]) -> _Result:
        if not self._end.alive or self._process != os.getpid():
            call.close()
            # A fork copies this object but not the thread that runs the connection.
            here = "is closed" if self._process == os.getpid() else "belongs to another process"
            raise Disconnected(f"this connection {here}; open another")
        future = asyncio.run_coroutine_threadsafe(call, self._loop)
        try:
            return future.result()
        except BaseException:  # Ctrl-C in the caller's thread ends the call, too
            future.cancel()
            raise

    async def _drain(self) -> list[Message]:
        events = self._client.events
        if events.empty() and self._client.has_ended:
            raise ended(None)
        return [events.get_nowait() for _ in range(events.qsize())]

    async def _wait_for(self, type: str, seconds: float) -> Message:
        async with asyncio.timeout(seconds):
            while True:
                event = asyncio.create_task(self._client.events.get())
                closed = asyncio.create_task(self._client.wait_closed())
                try:
                    await asyncio.wait({event, closed}, return_when=asyncio.FIRST_COMPLETED)
                    if not event.done():
                        raise ended(None)
                    if event.result()["type"] == type:
                        return event.result()
                finally:
                    event.cancel()
                    closed.cancel()


def _serve(loop: asyncio.AbstractEventLoop) -> None:
    """Run the loop until it is stopped, and close it."""
    loop.run_forever()
    loop.close()


def _leave(
    process: int,
    loop: asyncio.AbstractEventLoop,
    thread: threading.Thread,
    connection: AbstractAsyncContextManager[Client],
) -> None:
    """Close the connection, as far as it is open, and end its thread."""
    if process != os.getpid():  # a fork has the object and not the thread
        return

    async def close() -> None:
        with suppress(Exception):  # whatever it is, the thread ends
            async with asyncio.timeout(CLOSE_S):
                await connection.__aexit__(None, None, None)
        loop.stop()

    closing = close()
    try:
        asyncio.run_coroutine_threadsafe(closing, loop)
    except RuntimeError:  # the loop has ended before
        closing.close()
    # The garbage collector may call this in the loop's own thread, which cannot wait for itself.
    if thread is not threading.current_thread():
        thread.join(2.0 * CLOSE_S)


def connect_blocking(
    url: str = URL,
    *,
    name: str = "hapticvlm-python",
    role: str = "scene",
    token: str | None = None,
    tls: ssl.SSLContext | None = None,
) -> BlockingClient:
    """Open a connection to a service, for a program or a notebook without await.

    Parameters are those of `hapticvlm.connect`. Raises `Refused`, and `Disconnected` (also a
    ConnectionError) where no service answers.

        with hapticvlm.connect_blocking() as client:
            client.scene([{"object_id": "cup", "material": "ceramic", "temperature_c": 50.0}])
            with client.touching("cup"):
                time.sleep(2.0)
    """
    return BlockingClient(url, name, role, token, tls)
