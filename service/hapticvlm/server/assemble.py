"""Puts the service together out of its settings; run_service.py runs it.

What is asked beside the embedded encoder, a VLM or a shared recogniser, may be another machine.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass

from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.simulated.simulated_board import simulated_plate
from hapticvlm.devices.speaker.channels import DUALSENSE, OF_DUALSENSE, Channels, read_channels
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.devices.speaker.speaker_files import read_speaker_files
from hapticvlm.materials import Material
from hapticvlm.messages import Device, Devices, Models
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.server.access import Address
from hapticvlm.server.handshake import ServiceInfo
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.web import certificate, stated_materials
from hapticvlm.server.web.certificate import Certificate
from hapticvlm.server.web.recorded_sessions import RecordedSessions
from hapticvlm.vision.galleries.user_materials import read_folder, table_with
from hapticvlm.vision.remote.settings import RemoteSettings
from hapticvlm.vision.worker import RecogniserSettings, RecogniserWorker
from hapticvlm.vlm.contract import DEFAULT_MODEL, VlmSettings
from hapticvlm.vlm.worker import VlmWorker


@dataclass(frozen=True, slots=True)
class ServiceParts:
    """What the service is made of; each has to be started and closed."""

    speaker: Speaker
    plate: Peltier
    recogniser: RecogniserWorker
    vlm: VlmWorker | None
    recorder: Recorder | None
    table: Mapping[str, Material]
    saved: Mapping[str, str]


def address(serving: ServeOptions) -> Address:
    """Return where to listen and whom to let in. Raises ValueError."""
    return Address(
        serving.host,
        serving.port,
        serving.token,
        frozenset(serving.allow_origin),
        serving.scene,
        _certificate(serving),
        serving.pages_from,
    )


def build_service(serving: ServeOptions) -> ServiceParts:
    """Make every part, none of it started. Raises ValueError and OSError."""
    vlm = _vlm_worker(serving)  # first: what is refused here leaves nothing half made
    user_materials = read_folder(serving.gallery)
    table = table_with(user_materials)
    saved = {} if serving.stated is None else stated_materials.read(serving.stated, table)
    if user_materials or serving.patterns is not None:
        import scipy.signal  # noqa: F401 - may filter them; no touch waits until it is loaded
    settings = RecogniserSettings(
        serving.encoder,
        serving.gallery,
        user_materials,
        serving.encoder_device,
        serving.threads,
        _remote_settings(serving),
    )
    # Everything that reads a file or may refuse an option has happened above. From here on parts
    # are made that own processes, memory and ports; none is started yet, so a refusal leaves
    # nothing behind, and who starts them ends them in the other order.
    return ServiceParts(
        speaker=Speaker(_audio(serving, table)),
        plate=_plate(serving),
        recogniser=RecogniserWorker(settings),
        vlm=vlm,
        recorder=_recorder(serving),
        table=table,
        saved=saved,
    )


def _certificate(serving: ServeOptions) -> Certificate | None:
    if serving.tls_cert is None and serving.tls_key is None:
        return None
    if serving.tls_cert is None or serving.tls_key is None:
        raise ValueError("--tls-cert and --tls-key go together: state both")
    return certificate.load(serving.tls_cert, serving.tls_key)


def _recorder(serving: ServeOptions) -> Recorder | None:
    if serving.record is None:
        return None
    return Recorder(serving.record, frames=serving.record_frames)


def _sessions(serving: ServeOptions) -> RecordedSessions | None:
    """Return what shows the recorded sessions: their pages are made as `replay --view` does."""
    if serving.record is None:
        return None
    options = {
        "--gallery": serving.gallery,
        "--patterns": serving.patterns,
        "--speaker-response": serving.speaker_response,
    }
    given = [part for flag, path in options.items() if path for part in (flag, str(path))]
    # The page must show what was felt, so it is made with the materials, recordings and speaker
    # curve of this service. By a command, and not by a call: it computes for seconds, and a process
    # of its own takes no time from a touch and can be ended.
    command = (sys.executable, "-m", "hapticvlm", "replay", "--no-open", *given)
    return RecordedSessions(serving.record, command)


def _audio(serving: ServeOptions, table: Mapping[str, Material]) -> AudioSettings:
    files = (serving.speaker_response, serving.patterns)
    correction, patterns = read_speaker_files(*files, table)
    return AudioSettings(
        serving.speaker,
        serving.block,
        serving.wav,
        not serving.no_realtime,
        level=serving.level,
        materials=tuple(table.values()),
        patterns=patterns,
        correction=correction,
        channels=_channels(serving),
    )


def _channels(serving: ServeOptions) -> Channels | None:
    """Return the channels of the hands, if each has its own. Raises ValueError."""
    if serving.channels is not None:
        return read_channels(serving.channels)
    return OF_DUALSENSE if serving.speaker.lower() == DUALSENSE else None


def service_info(serving: ServeOptions, parts: ServiceParts) -> ServiceInfo:
    """Return what `welcome` reports of these parts, once they have started."""
    loaded = parts.recogniser.loaded
    vlm = None if parts.vlm is None else parts.vlm.settings.model
    return ServiceInfo(
        devices(parts),
        Models(encoder=loaded.encoder, gallery=loaded.gallery, vlm=vlm),
        parts.table,
        asks_elsewhere=serving.vlm_url is not None,
        crops_elsewhere=serving.recogniser_url is not None,
        recorder=parts.recorder,
        sessions=_sessions(serving),
        saved=parts.saved,
        contact_resistance=serving.contact_resistance,
        plate_resistance=serving.plate_resistance,
    )


def devices(parts: ServiceParts) -> Devices:
    """Return the outputs and which of them are simulated."""
    return Devices(
        speaker=Device(name=parts.speaker.name, simulated=parts.speaker.simulated),
        peltier=Device(name=parts.plate.name, simulated=parts.plate.simulated),
    )


def _plate(serving: ServeOptions) -> Peltier:
    realtime = not serving.no_realtime
    if serving.peltier == "simulated":
        return simulated_plate(realtime=realtime)
    return Peltier(serving.peltier, realtime=realtime)


def _vlm_worker(serving: ServeOptions) -> VlmWorker | None:
    """Make the process that asks a VLM, if one is wanted. Raises ModuleNotFoundError."""
    if serving.vlm is None and serving.vlm_url is None:
        return None
    _require(*(("torch", "transformers") if serving.vlm_url is None else ("httpx2",)))
    return VlmWorker(
        VlmSettings(
            model=serving.vlm or DEFAULT_MODEL,
            url=serving.vlm_url,
            token=os.environ.get("HAPTICVLM_VLM_TOKEN"),
            device=serving.vlm_device,
            threads=serving.vlm_threads,
            image_tokens=serving.image_tokens,
            timeout_s=serving.vlm_timeout,
        )
    )


def _require(*packages: str) -> None:
    """Refuse at the start what could not be loaded later. Raises ModuleNotFoundError."""
    for name in packages:
        if importlib.util.find_spec(name) is None:
            raise ModuleNotFoundError(name=name)


def _remote_settings(serving: ServeOptions) -> RemoteSettings | None:
    """Return which shared recogniser is asked, if one is named.

    Raises HttpError, and ModuleNotFoundError without the library that asks it.
    """
    if serving.recogniser_url is None:
        return None
    _require("httpx2")
    settings = RemoteSettings(
        url=serving.recogniser_url,
        token=os.environ.get("HAPTICVLM_RECOGNISER_TOKEN") or None,
        gallery=serving.recogniser_gallery,
        hash=serving.recogniser_hash,
        deadline_s=serving.recogniser_deadline,
        format=serving.recogniser_crops,
        may_be_clear=serving.recogniser_clear_text,
    )
    settings.address()
    return settings
