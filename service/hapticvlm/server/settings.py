"""Declares every option of `serve` once; flags, config file and checks follow from it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from hapticvlm.server.options import Flag, options_of, plate_resistance, thermal_strength
from hapticvlm.vlm.limits import ANSWER_S, IMAGE_TOKENS

CONNECTIONS = "connections"
OUTPUTS = "outputs"
RECOGNITION = "recognition"
SURROUNDINGS = "surroundings"
RECORDING = "recording"
GROUPS = {name: name for name in (RECORDING, CONNECTIONS, OUTPUTS, RECOGNITION)}
GROUPS[SURROUNDINGS] = "surroundings, read off frames by a vision-language model"


@dataclass(frozen=True, slots=True)
class ServeOptions:
    """Every setting of the running service."""

    record: Annotated[
        Path | None, Flag(RECORDING, "keep each session in a sub-folder of this one", "FOLDER")
    ] = None
    record_frames: Annotated[
        bool, Flag(RECORDING, "also keep the pictures; every scene is told so when it connects")
    ] = False
    host: Annotated[
        str, Flag(CONNECTIONS, "address to listen on; 0.0.0.0 is every network", "ADDRESS")
    ] = "127.0.0.1"
    port: Annotated[
        int, Flag(CONNECTIONS, "port to listen on, 0 for any free one", "PORT", range=(0, 65535))
    ] = 8790
    token: Annotated[
        str | None,
        Flag(
            CONNECTIONS,
            "secret that every client must send; needed beyond this machine; the variable "
            "HAPTICVLM_TOKEN keeps it out of the process list",
            "SECRET",
            env="HAPTICVLM_TOKEN",
        ),
    ] = field(default=None, repr=False)
    tls_cert: Annotated[
        Path | None,
        Flag(CONNECTIONS, "serve wss:// and https:// with this PEM certificate", "FILE"),
    ] = None
    tls_key: Annotated[
        Path | None,
        Flag(CONNECTIONS, "private key of the certificate, PEM without passphrase", "FILE"),
    ] = None
    allow_origin: Annotated[
        tuple[str, ...],
        Flag(
            CONNECTIONS,
            "let web pages of this origin connect too, e.g. https://example.org (repeatable)",
            "ORIGIN",
        ),
    ] = ()
    allow_host: Annotated[
        tuple[str, ...],
        Flag(
            CONNECTIONS,
            "answer under this name too, that of a tunnel or proxy; needs a token (repeatable)",
            "NAME",
        ),
    ] = ()
    scene: Annotated[
        Path | None, Flag(CONNECTIONS, "serve the web pages of this folder at /scene/", "FOLDER")
    ] = None
    lan: Annotated[
        bool,
        Flag(
            CONNECTIONS,
            "open pages and scenes to the local network: makes and keeps a token, and prints links "
            "and a code for a phone",
        ),
    ] = False
    pages_from: Annotated[
        Literal["this-machine", "lan"],
        Flag(
            CONNECTIONS,
            "who may open the pages; browsers of the local network are asked for the token",
        ),
    ] = "this-machine"
    speaker: Annotated[
        str,
        Flag(
            OUTPUTS,
            "audio output: simulated, default, jack, dualsense (a PS5 controller on USB), or part "
            "of its name",
            "NAME",
        ),
    ] = "simulated"
    channels: Annotated[
        str | None,
        Flag(
            OUTPUTS,
            "the output's channels of each hand, as left=1,right=2; without it one speaker gets "
            "both hands",
            "left=N,right=M",
        ),
    ] = None
    voice: Annotated[
        Literal["true", "sound"],
        Flag(
            OUTPUTS,
            "what the output plays: `true` for a palm speaker; `sound` for the speakers of a "
            "laptop or headphones, which moves the vibration to where ears hear it",
        ),
    ] = "true"
    patterns: Annotated[
        Path | None,
        Flag(
            OUTPUTS,
            "play the recordings of this folder instead of synthesis; their names are "
            "MATERIAL-INTERACTION.wav, or those of the paper's patterns",
            "FOLDER",
        ),
    ] = None
    speaker_response: Annotated[
        Path | None,
        Flag(
            OUTPUTS,
            "correct the speaker by this curve, written by `hapticvlm calibrate speaker`",
            "FILE",
        ),
    ] = None
    wav: Annotated[
        Path | None, Flag(OUTPUTS, "also write what is played to this WAV file", "FILE")
    ] = None
    block: Annotated[
        int,
        Flag(
            OUTPUTS,
            "samples of one audio block at 48 kHz; fewer are quicker",
            "SAMPLES",
            range=(16, 4800),
        ),
    ] = 128
    level: Annotated[
        float,
        Flag(
            OUTPUTS,
            "upper limit of the speaker's level, 0 to 1 of full scale, whatever a scene sets",
            "SHARE",
            range=(0.0, 1.0),
        ),
    ] = 1.0
    peltier: Annotated[
        str, Flag(OUTPUTS, "the plate: a serial port, `auto`, or `simulated`", "PORT")
    ] = "simulated"
    hand: Annotated[
        str | None,
        Flag(
            OUTPUTS,
            "what you own and is driven, too: weart (WEART TouchDIVER), intiface (controllers of "
            "Intiface Central), each by its program on this machine, or NAME=HOST:PORT; several "
            "with commas. Not tried on a device yet",
            "NAME",
        ),
    ] = None
    contact_resistance: Annotated[
        float | None,
        Flag(
            OUTPUTS,
            "contact resistance of the palm in m2 K/W (each material has its own)",
            "R",
            range=(0.0, 0.1),
        ),
    ] = None
    plate_resistance: Annotated[
        float,
        Flag(
            OUTPUTS,
            "resistance between palm and plate in m2 K/W, which the plate compensates, or a file "
            "that `hapticvlm calibrate plate` wrote",
            "R_OR_FILE",
            range=(0.0, 0.005),
            read=plate_resistance,
        ),
    ] = 4e-4  # PLATE_RESISTANCE of rendering.heat.contact, which would load numpy for --help
    thermal_strength: Annotated[
        float,
        Flag(
            OUTPUTS,
            "heat and cold as a share of the contact model's, until a client sets `thermal_gain`; "
            "lower it where real steel feels less cold. Or the file of `hapticvlm study match`",
            "SHARE_OR_FILE",
            range=(0.0, 1.0),
            read=thermal_strength,
        ),
    ] = 1.0
    feel: Annotated[
        Literal["full", "graded"],
        Flag(
            OUTPUTS,
            "rendering of an uncertain material: the one that errs least, in full, or, for "
            "studies, a mean of the probable ones at half level",
        ),
    ] = "full"
    no_realtime: Annotated[bool, Flag(OUTPUTS, "do not ask for real-time priority")] = False
    encoder: Annotated[
        str | None,
        Flag(
            RECOGNITION,
            "image network: a .onnx file, or the name or folder of any that transformers can load, "
            "which needs further packages (the shipped one)",
            "NAME_OR_FILE",
            names_path=True,
        ),
    ] = None
    gallery: Annotated[
        Path | None,
        Flag(
            RECOGNITION,
            ".npz file or gallery folder of reference pictures (the shipped one)",
            "GALLERY",
        ),
    ] = None
    stated: Annotated[
        Path | None,
        Flag(
            RECOGNITION,
            "materials of objects that a person stated at the dashboard, as its Save gives them",
            "FILE",
        ),
    ] = None
    encoder_device: Annotated[
        Literal["cpu", "cuda", "auto"],
        Flag(RECOGNITION, "where a network of transformers runs"),
    ] = "cpu"
    threads: Annotated[
        int, Flag(RECOGNITION, "CPU threads of the encoder", "N", range=(1, 1024))
    ] = 1
    recogniser_url: Annotated[
        str | None,
        Flag(
            RECOGNITION,
            "let the `hapticvlm recogniser-app` at this address recognise objects and texture "
            "maps; this service does it whenever that fails. Crops LEAVE this machine if it runs "
            "on another. Its token is in HAPTICVLM_RECOGNISER_TOKEN",
            "URL",
        ),
    ] = None
    recogniser_gallery: Annotated[
        str, Flag(RECOGNITION, "name of its gallery to be used", "NAME")
    ] = "shipped"
    recogniser_hash: Annotated[
        str | None,
        Flag(
            RECOGNITION,
            "accept its answers only if its encoder and gallery have this hash (see /v1/identity)",
            "HASH",
        ),
    ] = None
    recogniser_deadline: Annotated[
        float,
        Flag(
            RECOGNITION,
            "seconds for an object to be recognised; after three quarters of them this service "
            "begins to do it itself",
            "S",
            range=(0.02, 5.0),
        ),
    ] = 0.2
    recogniser_clear_text: Annotated[
        bool,
        Flag(RECOGNITION, "allow crops to leave this machine without encryption, over plain http"),
    ] = False
    vlm: Annotated[
        str | None,
        Flag(
            SURROUNDINGS,
            "ask this image-text model of transformers for the ambient temperature, and about "
            "objects that stay unknown; needs torch and transformers (none; --vlm alone means "
            "Qwen/Qwen2-VL-2B-Instruct)",
            "NAME_OR_FOLDER",
            bare="",
            names_path=True,
        ),
    ] = None
    vlm_url: Annotated[
        str | None,
        Flag(
            SURROUNDINGS,
            "ask an OpenAI-compatible endpoint instead; --vlm names its model. Frames LEAVE this "
            "machine if the endpoint is elsewhere. Its token is in HAPTICVLM_VLM_TOKEN",
            "URL",
        ),
    ] = None
    vlm_header: Annotated[
        str | None,
        Flag(
            SURROUNDINGS,
            "header that carries that token instead of Authorization (api-key for Azure)",
            "NAME",
        ),
    ] = None
    vlm_device: Annotated[str, Flag(SURROUNDINGS, "where that model runs: cpu or cuda", "NAME")] = (
        "cpu"
    )
    vlm_threads: Annotated[
        int, Flag(SURROUNDINGS, "CPU threads of that model", "N", range=(1, 1024))
    ] = 1
    image_tokens: Annotated[
        int,
        Flag(
            SURROUNDINGS,
            "a frame is given to it as at most this many tokens; fewer are quicker, and the makers "
            "of the default model advise 256 or more",
            "N",
            range=(4, 4096),
        ),
    ] = IMAGE_TOKENS
    vlm_timeout: Annotated[
        float, Flag(SURROUNDINGS, "seconds to wait for its answer", "S", range=(0.1, 600.0))
    ] = ANSWER_S


OPTIONS = options_of(ServeOptions)
