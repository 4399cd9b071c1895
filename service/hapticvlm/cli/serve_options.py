"""The options that running the service has, under any name."""

from __future__ import annotations

import argparse
from pathlib import Path


def add(serve: argparse.ArgumentParser) -> None:
    """Declare the options that serving has under any name."""
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


def check_ranges(options: argparse.Namespace) -> None:
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
