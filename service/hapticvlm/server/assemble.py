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
from hapticvlm.devices.speaker.channels import Channels, channels_of_hands
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.devices.speaker.speaker_files import read_speaker_files
from hapticvlm.devices.worn import table as worn_table
from hapticvlm.devices.worn.output import WornOutput
from hapticvlm.evidence.lexicon import read_lexicon
from hapticvlm.materials import Material
from hapticvlm.messages import SceneObject
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.web import overrides_file
from hapticvlm.vision.galleries.user_materials import read_folder, table_with
from hapticvlm.vision.remote.settings import RemoteSettings
from hapticvlm.vision.worker import RecogniserSettings, RecogniserWorker
from hapticvlm.vlm.contract import DEFAULT_MODEL, VlmSettings
from hapticvlm.vlm.endpoint import read_address
from hapticvlm.vlm.worker import VlmWorker


@dataclass(frozen=True, slots=True)
class ServiceParts:
    """The parts of the service; each has to be started and closed."""

    speaker: Speaker
    plate: Peltier
    recogniser: RecogniserWorker
    vlm: VlmWorker | None
    recorder: Recorder | None
    worn: tuple[WornOutput, ...]
    table: Mapping[str, Material]
    saved_materials: Mapping[str, SceneObject]

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
        parts = (*self.worn, self.speaker, self.recogniser, self.vlm, self.recorder)
        with ThreadPoolExecutor(len(parts)) as pool:
            closing = [pool.submit(part.close) for part in parts if part is not None]
        for closed in closing:
            closed.result()


def build_service(options: ServeOptions) -> ServiceParts:
    """Make every part, none of it started. Raises ValueError and OSError."""
    vlm = _vlm_worker(options)  # first: what is refused here leaves nothing half made
    user_materials = read_folder(options.gallery)
    table = table_with(user_materials)
    read_lexicon(table)  # now, so that no scene waits for its words
    saved = {} if options.stated is None else overrides_file.read(options.stated, table)
    settings = RecogniserSettings(
        options.encoder,
        options.gallery,
        user_materials,
        options.encoder_device,
        options.threads,
        _remote_settings(options),
    )
    audio = _audio(options, table)
    worn = () if options.hand is None else worn_table.make(options.hand, audio)
    # Everything that reads a file or may refuse an option has happened above. From here on parts
    # are made that own processes, memory and ports; none is started yet, so a refusal leaves
    # nothing behind, and who starts them ends them in the other order.
    return ServiceParts(
        speaker=Speaker(audio),
        plate=_plate(options),
        recogniser=RecogniserWorker(settings),
        vlm=vlm,
        recorder=_recorder(options),
        worn=worn,
        table=table,
        saved_materials=saved,
    )


def _recorder(options: ServeOptions) -> Recorder | None:
    if options.record is None:
        return None
    return Recorder(options.record, frames=options.record_frames)


def _audio(options: ServeOptions, table: Mapping[str, Material]) -> AudioSettings:
    files = (options.speaker_response, options.patterns)
    playback, patterns = read_speaker_files(*files, table)
    return AudioSettings(
        options.speaker,
        options.block,
        options.wav,
        not options.no_realtime,
        level=options.level,
        materials=tuple(table.values()),
        patterns=patterns,
        playback=playback,
        channels=_channels(options),
        voice=options.voice,
    )


def _channels(options: ServeOptions) -> Channels | None:
    """Return the channels of the hands, if each has its own. Raises ValueError."""
    hands = channels_of_hands(options.speaker, options.channels)
    if options.voice == "sound" and hands is not None:
        raise ValueError(
            "voice: sound is for one speaker, and each hand has a channel; leave it out"
        )
    return hands


def _plate(options: ServeOptions) -> Peltier:
    realtime = not options.no_realtime
    if options.peltier == "simulated":
        return simulated_plate(realtime=realtime)
    return Peltier(options.peltier, realtime=realtime)


def _vlm_worker(options: ServeOptions) -> VlmWorker | None:
    """Make the process that asks a VLM, if one is wanted.

    Raises HttpError, VlmError, ModuleNotFoundError.
    """
    if options.vlm is None and options.vlm_url is None:
        return None
    _require(*(("torch", "transformers") if options.vlm_url is None else ("httpx2",)))
    if options.vlm_url is not None:
        read_address(options.vlm_url)  # refused now, and not by the process that would ask it
    return VlmWorker(
        VlmSettings(
            model=options.vlm or DEFAULT_MODEL,
            url=options.vlm_url,
            token=os.environ.get("HAPTICVLM_VLM_TOKEN"),
            header=options.vlm_header,
            device=options.vlm_device,
            threads=options.vlm_threads,
            image_tokens=options.image_tokens,
            timeout_s=options.vlm_timeout,
        )
    )


def _require(*packages: str) -> None:
    """Refuse at the start what could not be loaded later. Raises ModuleNotFoundError."""
    for name in packages:
        if importlib.util.find_spec(name) is None:
            raise ModuleNotFoundError(name=name)


def _remote_settings(options: ServeOptions) -> RemoteSettings | None:
    """Return which shared recogniser is asked, if one is named.

    Raises HttpError, and ModuleNotFoundError without the library that asks it.
    """
    if options.recogniser_url is None:
        return None
    _require("httpx2")
    settings = RemoteSettings(
        url=options.recogniser_url,
        token=os.environ.get("HAPTICVLM_RECOGNISER_TOKEN") or None,
        gallery=options.recogniser_gallery,
        hash=options.recogniser_hash,
        deadline_s=options.recogniser_deadline,
        may_be_clear=options.recogniser_clear_text,
    )
    settings.address()
    return settings
