"""Runs an assembled service until it is asked to stop, and closes its parts.

It decides the order of start and end, the process's priority and garbage collection, and prints the
lines that say where the service listens. Knows no message.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, TypeVar

from hapticvlm import __version__
from hapticvlm.devices.worn.output import WornOutput
from hapticvlm.errors import out_of_memory, shell_word
from hapticvlm.messages import Devices
from hapticvlm.processes.model_worker import WorkerReply
from hapticvlm.server import log_writer, service_info, systemd
from hapticvlm.server.access import Address
from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.assemble import ServiceParts
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.supervision import Supervision
from hapticvlm.server.web import lan, scene_files
from hapticvlm.server.web.lan_pages import own_address
from hapticvlm.server.websocket import WebSocketServer
from hapticvlm.standard_streams import ENDS_WITH_INPUT
from hapticvlm.vision.galleries.user_materials import is_empty

GATEWAY_PRIORITY = 10
COLLECT_AFTER = (50_000, 20, 100)  # new objects, then collections of the younger generation
SWITCH_S = 0.001  # a stop passes through the plate's thread, which a busy loop delays otherwise

T = TypeVar("T")
logger = logging.getLogger(__name__)


def run(options: ServeOptions, where: Address, parts: ServiceParts) -> None:
    """Run the service of these parts until SIGINT, SIGTERM or SIGHUP, and close them.

    Raises OSError, ChildError or DeviceError where a part cannot be started.
    """
    stopping = asyncio.Event()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # Ctrl-C while asyncio makes its loop would leave half a loop, whose end shows a traceback.
        # It is kept until the loop handles signals by itself.
        signal.signal(signal.SIGINT, lambda *_: stopping.set())
    asyncio.run(_run(options, where, parts, stopping))


async def _run(
    options: ServeOptions, where: Address, parts: ServiceParts, stopping: asyncio.Event
) -> None:
    _on_signals(asyncio.get_running_loop(), stopping)
    if os.environ.pop(ENDS_WITH_INPUT, None) is not None:
        loop = asyncio.get_running_loop()
        threading.Thread(target=_end_with_input, args=(loop, stopping), daemon=True).start()
    asyncio.get_running_loop().set_exception_handler(report_error)
    gateway = Gateway(
        parts.speaker,
        parts.plate,
        parts.recogniser,
        parts.vlm,
        recorder=parts.recorder,
        log=log_writer.take_over(),
        worn=parts.worn,
    )
    gateway.outputs.thermal_gain = options.thermal_strength
    logging.getLogger("hapticvlm").addHandler(log_writer.ObserverLog(gateway.show_log))
    try:
        await _start(parts, gateway)
        server = WebSocketServer(
            where, gateway, service_info.service_info(options, parts), time.monotonic
        )
        has_priority = not options.no_realtime and _raise_priority()
        sys.setswitchinterval(SWITCH_S)
        async with server.listen() as port, asyncio.TaskGroup() as tasks:
            running = tasks.create_task(Supervision(gateway).run())
            # The objects so far live as long as the service: frozen, they are never scanned again,
            # which would delay a touch by 40 ms.
            gc.collect()
            gc.freeze()
            # By default Python scans young objects every 700 allocations and all of them soon
            # after, which takes 1.9 ms in the middle of a touch. Almost everything that a touch
            # allocates is freed by its reference count; cycles are rare.
            gc.set_threshold(*COLLECT_AFTER)
            print_ready(
                options, port, service_info.devices(parts), parts.worn, has_priority=has_priority
            )
            systemd.notify(systemd.READY)
            gateway.vibration.prepare()
            await stopping.wait()
            systemd.notify(systemd.STOPPING)
            gateway.close()
            running.cancel()
            # The outputs end first: closing a connection may wait for a client that does not read.
            parts.plate.close()
            await asyncio.to_thread(parts.speaker.close)
    finally:
        await asyncio.to_thread(parts.close)
    print("hapticvlm stopped, outputs at rest", flush=True)


def report_error(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log an error that nobody waited for: as a sentence if memory was used up."""
    error = context.get("exception")
    sentence = None if error is None else out_of_memory(error)
    if sentence is None:
        loop.default_exception_handler(context)
    else:
        logger.error("%s", sentence)


async def _start(parts: ServiceParts, gateway: Gateway) -> None:
    loop = asyncio.get_running_loop()
    # The plate starts first: it fails most often, and then no other part delays the error.
    await asyncio.to_thread(parts.plate.start)
    await asyncio.gather(
        asyncio.to_thread(parts.speaker.start),
        asyncio.to_thread(
            parts.recogniser.start, partial(_on_loop, loop, gateway.recognition.accept)
        ),
    )
    for output in parts.worn:
        output.start()
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
        if stopping.is_set():  # asked twice: exit at once; the audio engine fades by itself
            os._exit(130)
        stopping.set()

    numbers = [signal.SIGINT, signal.SIGTERM]
    closed_terminal = getattr(signal, "SIGHUP", None)  # Windows has none
    if closed_terminal is not None and signal.getsignal(closed_terminal) != signal.SIG_IGN:
        numbers.append(closed_terminal)  # nohup ignores it, and then the service continues
    for number in numbers:
        try:
            loop.add_signal_handler(number, stop)
        except NotImplementedError:
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop))


def _end_with_input(loop: asyncio.AbstractEventLoop, stopping: asyncio.Event) -> None:
    """Wait for the end of the input, which means that the owner of this service has ended."""
    with contextlib.suppress(OSError):
        while os.read(0, 4096):
            pass
    with contextlib.suppress(RuntimeError):  # the loop has closed
        loop.call_soon_threadsafe(stopping.set)


def _raise_priority() -> bool:
    if not hasattr(os, "sched_setscheduler"):
        return False
    with contextlib.suppress(OSError):
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(GATEWAY_PRIORITY))
        return True
    return False


def print_ready(
    options: ServeOptions,
    port: int,
    devices: Devices,
    worn: Sequence[WornOutput] = (),
    *,
    has_priority: bool,
) -> None:
    """Print the addresses of the service and its devices."""
    for line in _addresses(options, port):
        print(line, flush=True)
    for label, device in (("speaker", devices.speaker), ("plate", devices.peltier)):
        print(f"  {label:<12} {device.name}")
        if label == "speaker" and (heard := _heard(options)):
            print(f"  {'':<12} {heard}")
    for output in worn:
        print(f"  {'worn':<12} {output.name} ({output.state})")
    print(f"  priority     {'real-time' if has_priority else 'normal'}", flush=True)
    for line in _models(options):
        print(line, flush=True)


def _addresses(options: ServeOptions, port: int) -> Iterator[str]:
    shown = "127.0.0.1" if options.lan and options.host == "0.0.0.0" else _bracketed(options.host)
    s = "" if options.tls_cert is None else "s"
    yield f"hapticvlm {__version__} ready on ws{s}://{shown}:{port}/"
    base = f"http{s}://{shown}:{port}/"
    yield f"  status page  {base}"
    yield f"  try it       {base}try"
    scene, gallery = options.scene, options.gallery
    paths = [] if scene is None else scene_files.pages(scene)
    yield from _scenes(base, paths)
    if scene is not None and not paths:
        yield f"  scene        --scene {scene}: no index.html is in it; add one, or name another"
    if is_empty(gallery):
        cure = f"`hapticvlm gallery add ... --out {shell_word(str(gallery))}` adds one"
        yield f"  gallery      --gallery {gallery}: no material is in it, as if left out; {cure}"
    yield from _network(options, f"ws{s}", port, paths)


def _scenes(base: str, paths: Sequence[str]) -> Iterator[str]:
    return (f"  scene        {base.rstrip('/')}{path}" for path in paths)


def _models(options: ServeOptions) -> Iterator[str]:
    """Yield lines on models that are not in the service: what is sent where."""
    if options.recogniser_url is not None:
        yield f"  recogniser   {options.recogniser_url} (crops are sent there)"
    if options.vlm_url is not None:
        yield f"  vlm          {options.vlm_url} (frames are sent there)"
    elif options.vlm is not None:
        yield f"  vlm          {options.vlm or 'the default'}, loading"


def _heard(options: ServeOptions) -> str:
    """Say in which voice an output plays that may be heard and not felt; empty for others."""
    if options.speaker == "simulated":
        return "to hear it: --speaker default, or the pages above"
    if options.voice == "sound":
        return "plays as sound, for ears; --voice true is for a palm speaker"
    if options.speaker == "default":
        return "plays for a palm speaker; --voice sound is for the speakers of a laptop"
    return ""


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _code(link: str) -> Iterator[str]:
    """Yield the code of a link, and what it is for, where the terminal can show it."""
    code = lan.terminal_code(link)
    with contextlib.suppress(UnicodeError, LookupError):
        code.encode(sys.stdout.encoding or "ascii")
        yield code.rstrip("\n")
        yield "  Point a phone's camera at it. It holds the token: show it to nobody else."


def _network(options: ServeOptions, scheme: str, port: int, paths: Sequence[str]) -> Iterator[str]:
    """Yield lines on the network: its address, access to pages, and missing encryption."""
    if is_loopback(options.host):
        return
    address = own_address() if options.host in ("0.0.0.0", "::") else None
    if options.lan and options.token is not None:
        host = address or _bracketed(options.host)
        base = f"{scheme.replace('ws', 'http')}://{host}:{port}/"
        is_read_by_one = sys.stdout.isatty()  # a log or a journal is read by others as well
        yield from lan.lines(base, options.token if is_read_by_one else None)
        yield from _scenes(base, paths)
        if options.tls_cert is None:
            yield "  unencrypted  others on the network can read everything, also the token"
        if is_read_by_one:
            yield from _code(lan.phone_link(base, options.token))
        return
    if address is not None:
        yield f"  from others  {scheme}://{address}:{port}/"
    if options.pages_from == "lan":
        yield "  pages        open to the local network: any user name, the token as password"
    if options.tls_cert is None:
        yield "  unencrypted  others on the network can read everything, also the token: --tls-cert"
