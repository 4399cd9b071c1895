"""How the service is run: every option declared once; flags and the config file follow from it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

_MOST_BYTES = 65_536  # a calibration has some three hundred


def contact_resistance(text: str) -> float:
    """Read a contact resistance in m2 K/W, of any range; an argparse type.

    `text` is a number, or the file that `hapticvlm calibrate thermal --out FILE` wrote. Raises
    ArgumentTypeError that says what to give.
    """
    try:
        return float(text)
    except ValueError:
        pass
    told = _calibrated(Path(text))
    value = told.get("contact_resistance")
    if told.get("calibrate") != "thermal" or isinstance(value, bool):
        value = None
    if not isinstance(value, int | float):
        raise _not_a_result(text)
    return float(value)


def _calibrated(path: Path) -> dict[str, object]:
    try:
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        reason = error.strerror or error
        raise argparse.ArgumentTypeError(f"{path}: no number, and as a file: {reason}") from None
    try:
        told = json.loads(data) if len(data) <= _MOST_BYTES else None
    except (ValueError, RecursionError):
        told = None
    if not isinstance(told, dict):
        raise _not_a_result(str(path))
    return told


def _not_a_result(text: str) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(
        f"{text} is not what `hapticvlm calibrate thermal --out FILE` writes"
    )


CONNECTIONS, OUTPUTS, RECOGNITION = "connections", "outputs", "recognition"
SURROUNDINGS, RECORDING = "surroundings", "recording"
GROUPS = {
    RECORDING: "recording",
    CONNECTIONS: "connections",
    OUTPUTS: "outputs",
    RECOGNITION: "recognition",
    SURROUNDINGS: "surroundings, read off frames by a vision-language model",
}


@dataclass(frozen=True, slots=True)
class Flag:
    """What is said of an option: its group, its help, least and most of a number.

    `bare` is what the flag without a value means; `names_path`: a name that may also be a folder;
    `env`: the variable that a secret may come from; `read`: what takes the flag's text if not its
    type.
    """

    group: str
    help: str
    metavar: str | None = None
    range: tuple[float, float] | None = None
    bare: str | None = None
    names_path: bool = False
    env: str | None = None
    read: Callable[[str], Any] | None = None


@dataclass(frozen=True, slots=True)
class Serving:
    """Everything that running the service can be told."""

    record: Annotated[
        Path | None, Flag(RECORDING, "keep each session in a sub-folder", metavar="FOLDER")
    ] = None
    record_frames: Annotated[bool, Flag(RECORDING, "keep pictures too, and say so in welcome")] = (
        False
    )
    host: Annotated[str, Flag(CONNECTIONS, "address to listen on (%(default)s)")] = "127.0.0.1"
    port: Annotated[int, Flag(CONNECTIONS, "0 = any free one (%(default)s)", range=(0, 65535))] = (
        8790
    )
    token: Annotated[
        str | None,
        Flag(
            CONNECTIONS,
            "secret each client must send, needed off loopback; better from HAPTICVLM_TOKEN",
            env="HAPTICVLM_TOKEN",
        ),
    ] = field(default=None, repr=False)
    tls_cert: Annotated[
        Path | None,
        Flag(CONNECTIONS, "serve wss:// and https:// with this certificate, PEM", metavar="FILE"),
    ] = None
    tls_key: Annotated[
        Path | None, Flag(CONNECTIONS, "its private key, PEM, without passphrase", metavar="FILE")
    ] = None
    allow_origin: Annotated[
        tuple[str, ...],
        Flag(
            CONNECTIONS,
            "also let pages of this origin connect, e.g. https://example.org (repeatable)",
            metavar="ORIGIN",
        ),
    ] = ()
    scene: Annotated[
        Path | None,
        Flag(
            CONNECTIONS,
            "also serve this folder's pages and scripts at /scene/, as all pages",
            metavar="FOLDER",
        ),
    ] = None
    pages_from: Annotated[
        Literal["this-machine", "lan"],
        Flag(
            CONNECTIONS,
            "whose browsers see pages; the local network's are asked for the token (%(default)s)",
        ),
    ] = "this-machine"
    speaker: Annotated[
        str, Flag(OUTPUTS, "simulated, default, jack, or part of an output's name (%(default)s)")
    ] = "simulated"
    patterns: Annotated[
        Path | None,
        Flag(
            OUTPUTS,
            "replace what is synthesised by these WAV files, named MATERIAL-INTERACTION.wav or "
            "after one of the paper's patterns",
            metavar="DIR",
        ),
    ] = None
    speaker_response: Annotated[
        Path | None,
        Flag(
            OUTPUTS,
            "correct the speaker by this curve (see `hapticvlm calibrate speaker`)",
            metavar="FILE",
        ),
    ] = None
    wav: Annotated[Path | None, Flag(OUTPUTS, "also write what is played to this WAV file")] = None
    block: Annotated[
        int, Flag(OUTPUTS, "samples per audio block at 48 kHz (%(default)s)", range=(16, 4800))
    ] = 128
    level: Annotated[
        float,
        Flag(
            OUTPUTS,
            "most of full scale the speaker gets, 0..1, whatever a scene sets (%(default)s)",
            range=(0.0, 1.0),
        ),
    ] = 1.0
    peltier: Annotated[
        str,
        Flag(OUTPUTS, "the plate: a serial port, auto, or simulated (%(default)s)", metavar="PORT"),
    ] = "simulated"
    contact_resistance: Annotated[
        float | None,
        Flag(
            OUTPUTS,
            "of this palm, m2 K/W, or a file of `hapticvlm calibrate thermal --out` (by material)",
            metavar="R_OR_FILE",
            range=(0.0, 0.1),
            read=contact_resistance,
        ),
    ] = None
    plate_resistance: Annotated[
        float,
        Flag(
            OUTPUTS,
            "between palm and plate, m2 K/W: the plate goes ahead of the skin by it (%(default)s)",
            metavar="R",
            range=(0.0, 0.005),
        ),
    ] = 2e-4
    no_realtime: Annotated[bool, Flag(OUTPUTS, "do not ask for real-time priority")] = False
    encoder: Annotated[
        str | None,
        Flag(
            RECOGNITION,
            "image encoder: any image network of transformers by name or folder (extra `models`), "
            "or a file .onnx or .tflite (extra `files`) (the one shipped)",
            metavar="NAME_OR_FILE",
            names_path=True,
        ),
    ] = None
    gallery: Annotated[
        Path | None, Flag(RECOGNITION, "reference embeddings, or a gallery folder (those shipped)")
    ] = None
    device: Annotated[
        Literal["cpu", "cuda", "auto"],
        Flag(RECOGNITION, "what an encoder of transformers runs on (%(default)s)"),
    ] = "cpu"
    threads: Annotated[
        int, Flag(RECOGNITION, "of one inference on the cpu (%(default)s)", range=(1, 1024))
    ] = 1
    vlm: Annotated[
        str | None,
        Flag(
            SURROUNDINGS,
            "ask this image-text model of transformers for the ambient temperature and about "
            "objects the encoder leaves unknown; needs the extra `models` (none; without a name "
            "Qwen/Qwen2-VL-2B-Instruct)",
            metavar="NAME_OR_FOLDER",
            bare="",
            names_path=True,
        ),
    ] = None
    vlm_url: Annotated[
        str | None,
        Flag(
            SURROUNDINGS,
            "ask an OpenAI-compatible endpoint instead, --vlm names its model: frames LEAVE this "
            "machine if it is another; a token is taken from HAPTICVLM_VLM_TOKEN",
            metavar="URL",
        ),
    ] = None
    vlm_device: Annotated[str, Flag(SURROUNDINGS, "cpu or cuda (%(default)s)")] = "cpu"
    vlm_threads: Annotated[int, Flag(SURROUNDINGS, "(%(default)s)", range=(1, 1024))] = 1
    image_tokens: Annotated[
        int,
        Flag(
            SURROUNDINGS,
            "most tokens a frame may become, the knob of speed (%(default)s)",
            range=(4, 4096),
        ),
    ] = 64
    vlm_timeout: Annotated[
        float, Flag(SURROUNDINGS, "of an answer, s (%(default)s)", range=(0.1, 600.0))
    ] = 30.0


@dataclass(frozen=True, slots=True)
class Option:
    """One field of `Serving` as flags and files need it; `kind` is its type without None."""

    field: str
    kind: Any
    default: Any
    told: Flag

    @property
    def name(self) -> str:
        """What it is called in a config file: the flag without the dashes in front."""
        return self.field.replace("_", "-")

    @property
    def flag(self) -> str:
        """What it is called on the command line."""
        return f"--{self.name}"

    @property
    def choices(self) -> tuple[str, ...]:
        """The words it may be, or none if it is no choice of words."""
        return get_args(self.kind) if get_origin(self.kind) is Literal else ()

    @property
    def takes(self) -> str:
        """What value it wants, for people."""
        if self.told.range is not None:
            low, high = self.told.range
            return f"a {'whole ' if self.kind is int else ''}number, {low:g}..{high:g}"
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        return _TAKES.get(self.kind, "a text in quotes")


_TAKES = {bool: "true or false", tuple[str, ...]: 'a list of texts, as in ["..."]'}


def _options() -> tuple[Option, ...]:
    hints = get_type_hints(Serving, include_extras=True)
    found = []
    for one in fields(Serving):
        hint, flag = get_args(hints[one.name])
        kinds = [part for part in get_args(hint) if part is not NoneType]
        is_optional = NoneType in get_args(hint)
        found.append(Option(one.name, kinds[0] if is_optional else hint, one.default, flag))
    return tuple(found)


OPTIONS = _options()


def check_ranges(given: Mapping[str, Any]) -> None:
    """Refuse flags with numbers that no set-up has. Raises ValueError."""
    for option in OPTIONS:
        value = given.get(option.field)
        if option.told.range is None or value is None:
            continue
        low, high = option.told.range
        if not low <= value <= high:
            raise ValueError(f"{option.flag} {value:g}: outside {low:g}..{high:g}")
