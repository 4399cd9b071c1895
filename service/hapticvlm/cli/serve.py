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
    from hapticvlm.onlooker import Answer, Onlooker
    from hapticvlm.recognition.eye import Look
    from hapticvlm.server.edge import Address
    from hapticvlm.server.gateway import Gateway

GATEWAY_PRIORITY = 10


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    serve = commands.add_parser("serve", help="run the service a scene connects to")
    serve.add_argument(
        "--record", type=Path, metavar="FOLDER", help="keep each session in a sub-folder"
    )
    add_options(serve)


def add_options(serve: argparse.ArgumentParser) -> None:
    """Declare the options that serving has under any name."""
    serve.set_defaults(run=_serve)
    serve.add_argument(
        "--record-frames", action="store_true", help="keep pictures too, and say so in welcome"
    )
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
    listen.add_argument(
        "--scene",
        type=Path,
        metavar="FOLDER",
        help="also serve this folder's pages and scripts at /scene/, to this machine only",
    )
    outputs = serve.add_argument_group("outputs")
    outputs.add_argument(
        "--speaker",
        default="simulated",
        help="simulated, default, or part of an audio output's name (%(default)s)",
    )
    outputs.add_argument(
        "--patterns",
        type=Path,
        metavar="DIR",
        help="replace what is synthesised by these WAV files, named MATERIAL-INTERACTION.wav or "
        "after one of the paper's patterns",
    )
    outputs.add_argument(
        "--speaker-response",
        type=Path,
        metavar="FILE",
        help="correct the speaker by this curve (see `hapticvlm calibrate speaker`)",
    )
    outputs.add_argument("--wav", type=Path, help="also write what is played to this WAV file")
    outputs.add_argument(
        "--block", type=int, default=128, help="samples per audio block at 48 kHz (%(default)s)"
    )
    outputs.add_argument(
        "--level",
        type=float,
        default=1.0,
        help="most of full scale the speaker gets, 0..1, whatever a scene sets (%(default)s)",
    )
    outputs.add_argument(
        "--peltier",
        default="simulated",
        metavar="PORT",
        help="the plate: a serial port, auto, or simulated (%(default)s)",
    )
    outputs.add_argument(
        "--contact-resistance",
        type=float,
        metavar="R",
        help="of this palm, m2 K/W, from `hapticvlm calibrate thermal` (by material)",
    )
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
    _add_vlm(serve.add_argument_group("surroundings, read off frames by a vision-language model"))


def _add_vlm(vlm: argparse._ArgumentGroup) -> None:
    vlm.add_argument(
        "--vlm",
        nargs="?",
        const="",
        metavar="NAME_OR_FOLDER",
        help="ask this image-text model of transformers for the ambient temperature and about "
        "objects the encoder leaves unknown; needs the extra `models` (none; without a name "
        "Qwen/Qwen2-VL-2B-Instruct)",
    )
    vlm.add_argument(
        "--vlm-url",
        metavar="URL",
        help="ask an OpenAI-compatible endpoint instead, --vlm names its model: frames LEAVE this "
        "machine if it is another; a token is taken from HAPTICVLM_VLM_TOKEN",
    )
    vlm.add_argument("--vlm-device", default="cpu", help="cpu or cuda (%(default)s)")
    vlm.add_argument("--vlm-threads", type=int, default=1, help="(%(default)s)")
    vlm.add_argument(
        "--image-tokens",
        type=int,
        default=64,
        help="most tokens a frame may become, the knob of speed (%(default)s)",
    )
    vlm.add_argument(
        "--vlm-timeout", type=float, default=30.0, help="of an answer, s (%(default)s)"
    )


def _serve(options: argparse.Namespace) -> int:
    from hapticvlm.child import ChildError
    from hapticvlm.devices.peltier import DeviceError
    from hapticvlm.server.edge import Address

    if options.log_level == "warning":
        logging.getLogger("hapticvlm").setLevel(logging.INFO)
    logging.getLogger("websockets").setLevel(logging.WARNING)
    try:
        origins = frozenset(options.allow_origin)
        address = Address(options.host, options.port, options.token, origins, options.scene)
        _check_ranges(options)
        asyncio.run(_run_service(options, address))
    except (ValueError, OSError, ChildError, DeviceError) as error:
        print(f"hapticvlm serve: {error}", file=sys.stderr)
        return 2
    return 0


def _check_ranges(options: argparse.Namespace) -> None:
    """Refuse numbers that no set-up has. Raises ValueError."""
    for flag, value, low, high in (
        ("--level", options.level, 0.0, 1.0),
        ("--contact-resistance", options.contact_resistance, 0.0, 0.1),
        ("--vlm-timeout", options.vlm_timeout, 0.1, 600.0),
        ("--image-tokens", options.image_tokens, 4, 4096),
        ("--vlm-threads", options.vlm_threads, 1, 1024),
    ):
        if value is not None and not low <= value <= high:
            raise ValueError(f"{flag} {value:g}: outside {low:g}..{high:g}")


async def _run_service(options: argparse.Namespace, address: Address) -> None:
    import time

    from hapticvlm.devices.audio import AudioSettings
    from hapticvlm.devices.pattern_folder import read_patterns
    from hapticvlm.devices.peltier import Peltier
    from hapticvlm.devices.response import read_response
    from hapticvlm.devices.simulated_board import simulated_plate
    from hapticvlm.devices.speaker import Speaker
    from hapticvlm.messages import Device, Devices, Models
    from hapticvlm.recogniser import Recogniser, RecogniserSettings
    from hapticvlm.recognition.own import read_folder, table_with
    from hapticvlm.rendering.playback import Correction
    from hapticvlm.server.edge import Edge, Offer
    from hapticvlm.server.gateway import Gateway, ObserverLog
    from hapticvlm.server.recorder import Recorder

    recorder = Recorder(options.record, frames=options.record_frames) if options.record else None
    loop = asyncio.get_running_loop()
    stopping = asyncio.Event()
    _on_signals(loop, stopping)
    own = read_folder(options.gallery)
    table = table_with(own)
    correction = Correction()
    if options.speaker_response is not None:
        correction = read_response(options.speaker_response).correction()
    patterns = (
        () if options.patterns is None else read_patterns(options.patterns, table, correction)
    )
    speaker = Speaker(
        AudioSettings(
            options.speaker,
            options.block,
            options.wav,
            options.realtime,
            level=options.level,
            materials=tuple(table.values()),
            patterns=patterns,
            correction=correction,
        )
    )
    recogniser = Recogniser(
        RecogniserSettings(options.encoder, options.gallery, own, options.device, options.threads)
    )
    plate = simulated_plate() if options.peltier == "simulated" else Peltier(options.peltier)
    onlooker = _onlooker(options)
    gateway = Gateway(speaker, plate, recogniser, onlooker)
    logging.getLogger("hapticvlm").addHandler(ObserverLog(gateway))
    try:
        await asyncio.to_thread(plate.start)  # first: what fails here leaves no child half started
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
        vlm = None if onlooker is None else onlooker.settings.model
        models = Models(encoder=loaded.encoder, gallery=loaded.gallery, vlm=vlm)
        elsewhere = options.vlm_url is not None
        offer = Offer(
            devices,
            models,
            table,
            asks_elsewhere=elsewhere,
            recorder=recorder,
            contact_resistance=options.contact_resistance,
        )
        edge = Edge(address, gateway, offer, time.monotonic)
        if onlooker is not None:
            onlooker.start(partial(_pass_on, loop, gateway))
        has_priority = options.realtime and _take_priority()
        async with edge.listen() as port, asyncio.TaskGroup() as tasks:
            running = [
                tasks.create_task(gateway.run_ticks()),
                tasks.create_task(gateway.run_telemetry()),
            ]
            _say_ready(address.host, port, devices, has_priority)
            _say_vlm(options)
            await stopping.wait()
            gateway.close()
            for task in running:
                task.cancel()
            # The outputs end first: closing connections may wait for a client that does not read.
            plate.close()
            await asyncio.to_thread(speaker.close)
    finally:
        plate.close()
        closing = [speaker.close, recogniser.close]
        closing += [part.close for part in (onlooker, recorder) if part is not None]
        await asyncio.gather(*map(asyncio.to_thread, closing))
    print("hapticvlm stopped, outputs at rest", flush=True)


def _hand_over(loop: asyncio.AbstractEventLoop, gateway: Gateway, look: Look) -> None:
    """Pass an answer from the recogniser's reader thread to the event loop."""
    with contextlib.suppress(RuntimeError):  # the loop has closed
        loop.call_soon_threadsafe(gateway.on_look, look)


def _pass_on(loop: asyncio.AbstractEventLoop, gateway: Gateway, answer: Answer) -> None:
    """Pass an answer from the onlooker's reader thread to the event loop."""
    with contextlib.suppress(RuntimeError):  # the loop has closed
        loop.call_soon_threadsafe(gateway.on_answer, answer)


def _onlooker(options: argparse.Namespace) -> Onlooker | None:
    """Make the process that asks a VLM, if one is wanted. Raises ValueError."""
    from hapticvlm.onlooker import Onlooker
    from hapticvlm.recognition.vlm.answers import DEFAULT_MODEL, VlmSettings

    if options.vlm is None and options.vlm_url is None:
        return None
    return Onlooker(
        VlmSettings(
            model=options.vlm or DEFAULT_MODEL,
            url=options.vlm_url,
            token=os.environ.get("HAPTICVLM_VLM_TOKEN"),
            device=options.vlm_device,
            threads=options.vlm_threads,
            image_tokens=options.image_tokens,
            timeout_s=options.vlm_timeout,
        )
    )


def _say_vlm(options: argparse.Namespace) -> None:
    if options.vlm_url is not None:
        print(f"  vlm          {options.vlm_url}: frames are sent there", flush=True)
    elif options.vlm is not None:
        print(f"  vlm          {options.vlm or 'the default'}, loading", flush=True)


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
