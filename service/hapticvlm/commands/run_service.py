"""Runs the service that was put together until it is asked to stop, and takes it apart."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import logging
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

from hapticvlm import __version__
from hapticvlm.messages import Devices
from hapticvlm.processes.model_worker import WorkerReply
from hapticvlm.server import log_writer, service_info
from hapticvlm.server.access import Address
from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.assemble import ServiceParts
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.supervision import Supervision
from hapticvlm.server.web.lan_pages import own_address
from hapticvlm.server.websocket import WebSocketServer

GATEWAY_PRIORITY = 10
COLLECT_AFTER = (50_000, 20, 100)  # objects made, and collections of the younger
SWITCH_S = 0.001  # a stop passes through the plate's thread, which a busy loop holds up otherwise

T = TypeVar("T")


async def run(serving: ServeOptions, where: Address, parts: ServiceParts) -> None:
    """Run the service of these parts until SIGINT, SIGTERM or SIGHUP, and close them.

    Raises OSError, ChildError and DeviceError for what cannot be started.
    """
    stopping = asyncio.Event()
    _on_signals(asyncio.get_running_loop(), stopping)
    gateway = Gateway(
        parts.speaker,
        parts.plate,
        parts.recogniser,
        parts.vlm,
        recorder=parts.recorder,
        log=log_writer.take_over(),
    )
    logging.getLogger("hapticvlm").addHandler(log_writer.ObserverLog(gateway.show_log))
    try:
        await _start(parts, gateway)
        server = WebSocketServer(
            where, gateway, service_info.service_info(serving, parts), time.monotonic
        )
        has_priority = not serving.no_realtime and _raise_priority()
        sys.setswitchinterval(SWITCH_S)
        async with server.listen() as port, asyncio.TaskGroup() as tasks:
            running = tasks.create_task(Supervision(gateway).run())
            # What was made so far stays: looking through it again would hold up a touch by 40 ms.
            gc.collect()
            gc.freeze()
            # The default looks at the young every 700 objects and at all of them soon after, 1.9 ms
            # in the middle of a touch. What a touch makes dies by itself; cycles are few.
            gc.set_threshold(*COLLECT_AFTER)
            print_ready(serving, port, service_info.devices(parts), has_priority=has_priority)
            gateway.vibration.prepare()
            await stopping.wait()
            gateway.close()
            running.cancel()
            # The outputs end first: closing connections may wait for a client that does not read.
            parts.plate.close()
            await asyncio.to_thread(parts.speaker.close)
    finally:
        await asyncio.to_thread(parts.close)
    print("hapticvlm stopped, outputs at rest", flush=True)


async def _start(parts: ServiceParts, gateway: Gateway) -> None:
    loop = asyncio.get_running_loop()
    # The plate is first: it is what fails most often, and then nothing else is waited for.
    await asyncio.to_thread(parts.plate.start)
    await asyncio.gather(
        asyncio.to_thread(parts.speaker.start),
        asyncio.to_thread(
            parts.recogniser.start, partial(_on_loop, loop, gateway.recognition.accept)
        ),
    )
    if parts.vlm is not None:
        parts.vlm.start(partial(_on_loop, loop, gateway.on_reply))


def _on_loop(
    loop: asyncio.AbstractEventLoop,
    receive: Callable[[WorkerReply[T]], None],
    answered: WorkerReply[T],
) -> None:
    """Forward a worker's answer from its reader thread to the event loop."""
    with contextlib.suppress(RuntimeError):  # the loop has closed
        loop.call_soon_threadsafe(receive, answered)


def _on_signals(loop: asyncio.AbstractEventLoop, stopping: asyncio.Event) -> None:
    def stop() -> None:
        if stopping.is_set():  # asked twice: leave at once, the engine fades by itself
            os._exit(130)
        stopping.set()

    numbers = [signal.SIGINT, signal.SIGTERM]
    closed_terminal = getattr(signal, "SIGHUP", None)  # Windows has none
    if closed_terminal is not None and signal.getsignal(closed_terminal) != signal.SIG_IGN:
        numbers.append(closed_terminal)  # ignored under nohup: then it goes on
    for number in numbers:
        try:
            loop.add_signal_handler(number, stop)
        except NotImplementedError:
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop))


def _raise_priority() -> bool:
    if not hasattr(os, "sched_setscheduler"):
        return False
    with contextlib.suppress(OSError):
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(GATEWAY_PRIORITY))
        return True
    return False


def print_ready(serving: ServeOptions, port: int, devices: Devices, *, has_priority: bool) -> None:
    """Print where the service listens (on `port`) and what it drives."""
    shown = f"[{serving.host}]" if ":" in serving.host else serving.host
    s = "" if serving.tls_cert is None else "s"
    print(f"hapticvlm {__version__} ready on ws{s}://{shown}:{port}/", flush=True)
    print(f"  status page  http{s}://{shown}:{port}/")
    print(f"  feel this    http{s}://{shown}:{port}/try")
    for line in _network(serving, f"ws{s}", port):
        print(line)
    for label, device in (("speaker", devices.speaker), ("plate", devices.peltier)):
        print(f"  {label:<12} {device.name}{' (simulated)' if device.simulated else ''}")
    print(f"  priority     {'real-time' if has_priority else 'normal'}", flush=True)
    if serving.recogniser_url is not None:
        print(f"  recogniser   {serving.recogniser_url}: crops are sent there", flush=True)
    if serving.vlm_url is not None:
        print(f"  vlm          {serving.vlm_url}: frames are sent there", flush=True)
    elif serving.vlm is not None:
        print(f"  vlm          {serving.vlm or 'the default'}, loading", flush=True)


def _network(serving: ServeOptions, scheme: str, port: int) -> Iterator[str]:
    """Yield what others on the network use, how they see pages, and who can read along."""
    if is_loopback(serving.host):
        return
    address = own_address() if serving.host in ("0.0.0.0", "::") else None
    if address is not None:
        yield f"  from others  {scheme}://{address}:{port}/"
    if serving.pages_from == "lan":
        yield "  pages        for the local network too: any name, the token as password"
    if serving.tls_cert is None:
        yield "  unencrypted  the network can read along, the token too: see --tls-cert"
