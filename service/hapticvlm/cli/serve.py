"""`hapticvlm serve`: puts the service together and runs it."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import os
import signal
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm import __version__

if TYPE_CHECKING:
    from hapticvlm.cli import Commands
    from hapticvlm.messages import Devices
    from hapticvlm.recognition.eye import Look
    from hapticvlm.server.edge import Address
    from hapticvlm.server.gateway import Gateway

GATEWAY_PRIORITY = 10


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    serve = commands.add_parser("serve", help="run the service a scene connects to")
    serve.set_defaults(run=_serve)
    listen = serve.add_argument_group("connections")
    listen.add_argument("--host", default="127.0.0.1", help="address to listen on (%(default)s)")
    listen.add_argument("--port", type=int, default=8790, help="0 = any free one (%(default)s)")
    listen.add_argument("--token", help="secret each client must send; needed off loopback")
    listen.add_argument(
        "--allow-origin",
        action="append",
        default=[],
        metavar="ORIGIN",
        help="also let pages of this origin connect, e.g. https://example.org (repeatable)",
    )
    outputs = serve.add_argument_group("outputs")
    outputs.add_argument(
        "--speaker",
        default="simulated",
        help="simulated, default, or part of an audio output's name (%(default)s)",
    )
    outputs.add_argument("--wav", type=Path, help="also write what is played to this WAV file")
    outputs.add_argument(
        "--block", type=int, default=128, help="samples per audio block at 48 kHz (%(default)s)"
    )
    outputs.add_argument("--peltier", default="simulated", help="the plate (%(default)s)")
    outputs.add_argument(
        "--no-realtime",
        dest="realtime",
        action="store_false",
        help="do not ask for real-time priority",
    )
    models = serve.add_argument_group("recognition")
    models.add_argument(
        "--encoder",
        metavar="NAME_OR_FOLDER",
        help="image encoder: a folder with an encoder.json, or any ConvNeXt of transformers by "
        "folder or name, which needs the extra `models` (the one shipped)",
    )
    models.add_argument(
        "--gallery", type=Path, help="reference embeddings, or a gallery folder (those shipped)"
    )
    models.add_argument(
        "--device",
        default="cpu",
        choices=["cpu", "cuda", "auto"],
        help="what an encoder of transformers runs on (%(default)s)",
    )
    models.add_argument(
        "--threads", type=int, default=1, help="of one inference on the cpu (%(default)s)"
    )
    models.add_argument("--vlm", help="vision-language model for the ambient temperature (none)")


def _serve(options: argparse.Namespace) -> int:
    from hapticvlm.child import ChildError
    from hapticvlm.devices.peltier import DeviceError
    from hapticvlm.server.edge import Address

    if options.log_level == "warning":
        logging.getLogger("hapticvlm").setLevel(logging.INFO)
    logging.getLogger("websockets").setLevel(logging.WARNING)
    try:
        _refuse_unbuilt(options)
        origins = frozenset(options.allow_origin)
        address = Address(options.host, options.port, options.token, origins)
        asyncio.run(_run_service(options, address))
    except (ValueError, OSError, ChildError, DeviceError) as error:
        print(f"hapticvlm serve: {error}", file=sys.stderr)
        return 2
    return 0


def _refuse_unbuilt(options: argparse.Namespace) -> None:
    if options.peltier != "simulated":
        raise ValueError(f"--peltier {options.peltier}: only `simulated` is built so far")
    if options.vlm is not None:
        raise ValueError("--vlm: not built so far; state `ambient_c` in the scene instead")


async def _run_service(options: argparse.Namespace, address: Address) -> None:
    import time

    from hapticvlm.devices.audio import AudioSettings
    from hapticvlm.devices.simulated import SimulatedPlate
    from hapticvlm.devices.speaker import Speaker
    from hapticvlm.messages import Device, Devices, Models
    from hapticvlm.recogniser import Recogniser, RecogniserSettings
    from hapticvlm.recognition.own import read_folder, table_with
    from hapticvlm.server.edge import Edge, Offer
    from hapticvlm.server.gateway import Gateway, ObserverLog

    loop = asyncio.get_running_loop()
    stopping = asyncio.Event()
    _on_signals(loop, stopping)
    own = read_folder(options.gallery)
    table = table_with(own)
    speaker = Speaker(
        AudioSettings(
            options.speaker,
            options.block,
            options.wav,
            options.realtime,
            materials=tuple(table.values()),
        )
    )
    recogniser = Recogniser(
        RecogniserSettings(options.encoder, options.gallery, own, options.device, options.threads)
    )
    plate = SimulatedPlate()
    gateway = Gateway(speaker, plate, recogniser)
    logging.getLogger("hapticvlm").addHandler(ObserverLog(gateway))
    try:
        await asyncio.gather(
            asyncio.to_thread(speaker.start),
            asyncio.to_thread(
                recogniser.start,
                partial(_hand_over, loop, gateway),
            ),
        )
        devices = Devices(
            speaker=Device(name=speaker.name, simulated=speaker.simulated),
            peltier=Device(name=plate.name, simulated=plate.simulated),
        )
        loaded = recogniser.loaded
        models = Models(encoder=loaded.encoder, gallery=loaded.gallery)
        edge = Edge(address, gateway, Offer(devices, models, table), time.monotonic)
        has_priority = options.realtime and _take_priority()
        async with edge.listen() as port, asyncio.TaskGroup() as tasks:
            running = [
                tasks.create_task(gateway.run_ticks()),
                tasks.create_task(gateway.run_telemetry()),
            ]
            _say_ready(address.host, port, devices, has_priority)
            await stopping.wait()
            gateway.close()
            for task in running:
                task.cancel()
            # The outputs end first: closing connections may wait for a client that does not read.
            plate.close()
            await asyncio.to_thread(speaker.close)
    finally:
        plate.close()
        await asyncio.gather(asyncio.to_thread(speaker.close), asyncio.to_thread(recogniser.close))
    print("hapticvlm stopped, outputs at rest", flush=True)


def _hand_over(loop: asyncio.AbstractEventLoop, gateway: Gateway, look: Look) -> None:
    """Pass an answer from the recogniser's reader thread to the event loop."""
    with contextlib.suppress(RuntimeError):  # the loop has closed
        loop.call_soon_threadsafe(gateway.on_look, look)


def _say_ready(host: str, port: int, devices: Devices, has_priority: bool) -> None:
    shown = f"[{host}]" if ":" in host else host
    print(f"hapticvlm {__version__} ready on ws://{shown}:{port}/", flush=True)
    print(f"  status page  http://{shown}:{port}/")
    for label, device in (("speaker", devices.speaker), ("plate", devices.peltier)):
        print(f"  {label:<12} {device.name}{' (simulated)' if device.simulated else ''}")
    print(f"  priority     {'real-time' if has_priority else 'normal'}", flush=True)


def _on_signals(loop: asyncio.AbstractEventLoop, stopping: asyncio.Event) -> None:
    def stop() -> None:
        if stopping.is_set():  # asked twice: leave at once, the engine fades by itself
            os._exit(130)
        stopping.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            loop.add_signal_handler(number, stop)
        except NotImplementedError:
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop))


def _take_priority() -> bool:
    if not hasattr(os, "sched_setscheduler"):
        return False
    with contextlib.suppress(OSError):
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(GATEWAY_PRIORITY))
        return True
    return False
