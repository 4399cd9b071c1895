"""Puts the service together out of its settings; run_service.py runs it.

A VLM and a shared recogniser may run on another machine.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.simulated.simulated_board import simulated_plate
from hapticvlm.devices.speaker.channels import (
    DUALSENSE,
    DUALSENSE_CHANNELS,
    Channels,
    read_channels,
)
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.devices.speaker.speaker_files import read_speaker_files
from hapticvlm.materials import Material
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.web import overrides_file
from hapticvlm.vision.galleries.user_materials import read_folder, table_with
from hapticvlm.vision.remote.settings import RemoteSettings
from hapticvlm.vision.worker import RecogniserSettings, RecogniserWorker
from hapticvlm.vlm.contract import DEFAULT_MODEL, VlmSettings
from hapticvlm.vlm.worker import VlmWorker


@dataclass(frozen=True, slots=True)
class ServiceParts:
    """The parts of the service; each has to be started and closed."""

    speaker: Speaker
    plate: Peltier
    recogniser: RecogniserWorker
    vlm: VlmWorker | None
    recorder: Recorder | None
    table: Mapping[str, Material]
    saved_materials: Mapping[str, str]

    def begin(self) -> None:
        """Let the processes of speaker and recogniser start, and do not wait for them.

        They need longer than all that this process still has to import.
        """
        self.speaker.begin()
        self.recogniser.worker.begin_early()

    def close(self) -> None:
        """End whatever has begun or started: the plate first, then all others at once.

        Each may wait a while for a process that hangs, and none for another's.
        """
        self.plate.close()
        parts = (self.speaker, self.recogniser, self.vlm, self.recorder)
        with ThreadPoolExecutor(len(parts)) as pool:
            closing = [pool.submit(part.close) for part in parts if part is not None]
        for closed in closing:
            closed.result()


def build_service(serving: ServeOptions) -> ServiceParts:
    """Make every part, none of it started. Raises ValueError and OSError."""
    vlm = _vlm_worker(serving)  # first: what is refused here leaves nothing half made
    user_materials = read_folder(serving.gallery)
    table = table_with(user_materials)
    saved = {} if serving.stated is None else overrides_file.read(serving.stated, table)
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
        saved_materials=saved,
    )


def _recorder(serving: ServeOptions) -> Recorder | None:
    if serving.record is None:
        return None
    return Recorder(serving.record, frames=serving.record_frames)


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
    return DUALSENSE_CHANNELS if serving.speaker.lower() == DUALSENSE else None


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
