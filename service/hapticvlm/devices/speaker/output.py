"""Opens a real audio output by its name, and detects its loss when it stops requesting samples.

No audio stack reports reliably that an output was unplugged (through miniaudio, PulseAudio does so
neither for a removed sink nor for a dead server). But an output that is gone no longer requests
samples, and that is detected here. `output_loop.py` decides what follows from a loss.

"jack" is a JACK server (or PipeWire's). The list of outputs does not name it when ALSA or
PulseAudio is installed as well. Through miniaudio its stream opens with two channels only, and it
buffers nothing between two periods, so a single missed period is audible.
"""

from __future__ import annotations

import ctypes
import functools
import os
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.speaker.channels import (
    DUALSENSE,
    DUALSENSE_CHANNELS,
    JACK,
    Channels,
    is_dualsense,
    positions,
)
from hapticvlm.devices.speaker.output_state import APP_NAME, DUMMY, output_state
from hapticvlm.errors import HapticVLMError, installing
from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.vibration.vibration import RATE_HZ

BUFFERED_BLOCKS = 3  # miniaudio's default number of periods: a longer gap empties all of them
JACK_BLOCKS = 2  # periods between two requests when one request was missed
LOST_S = 1.0  # without a request until an output counts as lost
STEADY_WITHIN_S = 8.0  # PulseAudio plays up to 2 s of its own silence before the first request
STEADY_S = 0.25
_POLL_S = 0.02
_PULSE_AS_ALSA, _PULSE_AUX = 1, 2  # pa_channel_map_def_t; in the first, 4 are front and rear
_PRO_AUDIO = re.compile(r" Pro( \d+)?$")  # as PipeWire ends the names of outputs without positions
# Of <sys/mman.h>; the second is Linux's: lock what is in memory now, and the rest once it is used.
# Without it the unused 80 MB of libraries and of their buffers would be read into memory, too.
_MCL_CURRENT = 1
_MCL_ONFAULT = 4

Fill = Callable[[int], NDArray[np.float32]]


class OutputError(HapticVLMError):
    """The output cannot be opened; the message says why and what to do."""


@dataclass(slots=True)
class Output:
    """One stream to an audio output.

    `fill` is called in the audio system's thread and renders each block. `realtime` requests
    real-time priority for that thread, and `has_priority` says whether it was granted. `hands` maps
    the hands to channels; None sends the mix to all channels.
    """

    fill: Fill
    realtime: bool
    name: str = ""
    system_name: str = ""
    has_priority: bool = False
    underruns: int = 0
    last_request_at: float = 0.0
    requested_samples: int = 0
    failure: Exception | None = None
    hands: Channels | None = None
    _channels: int = 1
    _max_gap_blocks: int = BUFFERED_BLOCKS
    _device: Any = field(default=None, repr=False)

    def open(self, requested: str, block: int) -> None:
        """Start playing on the output named `requested`, `block` samples at a time.

        Raises OutputError.
        """
        miniaudio = _library()
        is_jack = requested.lower() == JACK
        self._channels, self._max_gap_blocks = (2, JACK_BLOCKS) if is_jack else (1, BUFFERED_BLOCKS)
        try:
            chosen = None if is_jack else choose(playbacks(), requested, self.system_name)
            channel_map = () if is_jack else _channel_map(chosen, self.hands)
            is_aux = "aux0" in channel_map
            if self.hands is not None:
                usual = len(channel_map) or self._channels
                self._channels = _channels_of(chosen, self.hands, usual)
            elif is_aux:
                self._channels = len(channel_map)
            self._device = _playback_device(
                positions(self._channels, is_aux=is_aux),
                _PULSE_AUX if is_aux else _PULSE_AS_ALSA,
                output_format=miniaudio.SampleFormat.FLOAT32,
                nchannels=self._channels,
                sample_rate=RATE_HZ,
                buffersize_msec=max(1, round(block * 1000 / RATE_HZ)),
                device_id=chosen["id"] if chosen else None,
                backends=[miniaudio.Backend.JACK] if is_jack else None,
                app_name=APP_NAME,
            )
            if "null" in self._device.backend.lower():
                raise OutputError("this machine has no audio output; connect one")
            stream = self._blocks()
            next(stream)
            self._device.start(stream)
        except miniaudio.MiniaudioError as error:
            self.close()
            raise OutputError(f"the audio system reports: {error.args[0]}") from error
        self.name = chosen["name"] if chosen else f"default output ({self._device.backend})"
        self.system_name = chosen.get("system_name", "") if chosen else ""

    def wait_until_steady(self, beat: Callable[[], None]) -> None:
        """Wait until the output requests samples steadily; call `beat` meanwhile.

        Raises OutputError after STEADY_WITHIN_S.
        """
        deadline = time.monotonic() + STEADY_WITHIN_S
        before = self.requested_samples
        since = time.monotonic()
        # An output that has just opened may request samples in bursts, to fill its own buffer, or
        # none for two seconds. Touches would be late during that time. So the service reports ready
        # only when the output requested, within STEADY_S, at least half of what STEADY_S plays; and
        # until then no gap counts as an underrun.
        while self.requested_samples - before < STEADY_S * RATE_HZ / 2:
            beat()
            time.sleep(_POLL_S)
            now = time.monotonic()
            if now > deadline:
                self.close()
                raise OutputError(
                    f"{self.name} opened, but requested no samples within {STEADY_WITHIN_S:g} s"
                )
            if now - since > STEADY_S:
                before = self.requested_samples
                since = now

    def is_lost(self, now: float, awake_since: float) -> bool:
        """Return whether the output has requested no samples for LOST_S.

        `awake_since` is the time since which the caller has watched without a gap.
        """
        # No output requests samples while a machine is suspended, and that is not a loss. After the
        # suspend this process may also be scheduled before the sound server is. So the silence is
        # counted from the moment at which the caller woke, and an output gets a whole LOST_S after
        # waking for its next request.
        return now - max(self.last_request_at, awake_since) > LOST_S

    def close(self) -> None:
        """Stop playing."""
        device = self._device
        self._device = None
        if device is not None:
            device.close()
            # miniaudio's binding would leave the device's connection to the sound server open.
            _library().lib.ma_context_uninit(device._context)

    def _blocks(self) -> Generator[NDArray[np.float32], int, None]:
        # miniaudio sends into this generator the number of samples it needs and plays what is
        # yielded. The generator runs in a thread of the audio system, so priority is requested here
        # and not in open(). An exception would end that thread silently, so it is stored, and
        # `Player` raises it in the engine's main thread.
        count = yield np.empty(0, np.float32)
        self.has_priority = self.realtime and request_priority()
        while True:
            now = time.monotonic()
            gap = now - self.last_request_at
            self.last_request_at = now
            is_steady = self.requested_samples > STEADY_S * RATE_HZ
            self.underruns += is_steady and gap > self._max_gap_blocks * count / RATE_HZ
            self.requested_samples += count
            try:
                block = self.fill(count)
            except Exception as error:
                self.failure = error
                raise
            count = yield self._spread(block)

    def _spread(self, block: NDArray[np.float32]) -> NDArray[np.float32]:
        """Copy a block, (N,) or (N, 2) a hand per column, into interleaved channels, (N * C,)."""
        if self.hands is not None:
            return self.hands.spread(block, self._channels).ravel()
        return block if self._channels == 1 else np.repeat(block, self._channels)


def _library() -> Any:  # noqa: ANN401 - it has no types
    """Return miniaudio, which has no wheels for ARM with Linux or Windows. Raises OutputError."""
    try:
        import miniaudio
    except ImportError as error:
        raise OutputError(
            "a real speaker needs miniaudio, which is not installed on this kind of machine; "
            f"`{installing('miniaudio')}` builds it with a C compiler"
        ) from error
    return miniaudio


def playbacks() -> list[dict[str, Any]]:
    """Return the outputs of this machine, each with its `name`, `id` and `system_name`.

    A name that two of them have is followed by the system's. Raises OutputError.
    """
    miniaudio = _library()
    _mute_alsa()
    outputs: list[dict[str, Any]] = miniaudio.Devices().get_playbacks()
    for output in outputs:
        encoding = "utf-16-le" if sys.platform == "win32" else "utf-8"
        raw = bytes(miniaudio.ffi.buffer(output["id"])).decode(encoding, "ignore")
        output["system_name"] = raw.partition("\0")[0]
    names = Counter(output["name"] for output in outputs)
    for output in [each for each in outputs if names[each["name"]] > 1]:
        output["name"] += f" [{output['system_name']}]"
    return [output for output in outputs if output["system_name"] != DUMMY]


@functools.cache
def _mute_alsa() -> object:
    """Keep ALSA from writing each of its failed attempts to the terminal.

    Returns the handler, which must live as long as the library may call it.
    """
    try:
        alsa = ctypes.CDLL("libasound.so.2")
    except OSError:  # not Linux, or ALSA is not installed
        return None
    kinds = (ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p)
    handler = ctypes.CFUNCTYPE(None, *kinds)(lambda *_: None)
    alsa.snd_lib_error_set_handler(handler)
    return handler


def choose(
    outputs: Sequence[dict[str, Any]], requested: str, system_name: str = ""
) -> dict[str, Any] | None:
    """Return the output with the requested name, or the only one whose name contains it.

    The output of `system_name` was chosen before and is returned if it is there. Case does not
    matter. "default" returns None and needs only that there is an output. "dualsense" returns a PS5
    controller, which systems list under other names. Raises OutputError, naming the outputs of this
    machine.
    """
    if requested == "default" and outputs:
        return None
    if before := [each for each in outputs if system_name and each["system_name"] == system_name]:
        return before[0]
    is_pad = requested.lower() == DUALSENSE
    named = (_with_voice_coils if is_pad else _named)(outputs, requested.lower())
    if len(named) == 1:
        return named[0]
    names = ", ".join(output["name"] for output in named or outputs) or "none"
    if named:
        channels = " as --speaker, and --channels left=3,right=4" if is_pad else ""
        raise OutputError(f"several outputs match: {names}; give more of the name{channels}")
    raise OutputError(f"no such output; this machine has: {names}")


def _named(outputs: Sequence[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """Return the outputs of this name in lower case; without one all that contain it."""
    keys = ("name", "system_name")
    exact = [each for each in outputs if name in [each.get(key, "").lower() for key in keys]]
    return exact or [each for each in outputs if name in each["name"].lower()]


def _with_voice_coils(outputs: Sequence[dict[str, Any]], _: str) -> list[dict[str, Any]]:
    """Return the outputs of PS5 controllers with all four channels. Raises OutputError.

    Linux may split the controller into a speaker, headphones and one output of all four channels.
    """
    outputs = [each for each in outputs if is_dualsense(each["name"])]
    if not outputs:
        raise OutputError(
            "no PS5 controller found among the sound outputs: connect it by USB, as Bluetooth "
            "carries no sound to it"
        )
    needed = DUALSENSE_CHANNELS.min_count
    if whole := [each for each in outputs if (_channel_count(each) or needed) >= needed]:
        return whole
    names = ", ".join(f"{output['name']} ({_channel_count(output)} channels)" for output in outputs)
    raise OutputError(
        f"no output of the PS5 controller has the four channels of its voice coils: {names}; "
        "choose the profile `Haptic Feedback`, `Surround 4.0` or `Pro Audio` in the system's sound "
        "settings. A PS4 controller has none"
    )


def _channel_map(output: dict[str, Any] | None, hands: Channels | None) -> tuple[str, ...]:
    """Return the names of an output's channels; () if unknown. Raises OutputError."""
    name = "default" if output is None else output["system_name"]
    state = output_state(name, pid=os.getpid())
    if state is None and hands is not None and output and _PRO_AUDIO.search(output["name"]):
        raise OutputError(
            f"{output['name']}: the channels of the profile `Pro Audio` are told by `pactl` only; "
            "install pulseaudio-utils, or choose the profile `Haptic Feedback` or `Surround 4.0`"
        )
    return () if state is None else state.channel_map


def _channel_count(output: dict[str, Any]) -> int:
    """Return the most channels that an output has; 0 if the system does not tell."""
    return max((form["channels"] for form in output.get("formats", ())), default=0)


def _channels_of(output: dict[str, Any] | None, hands: Channels, usual: int) -> int:
    """Return the number of channels to open: all that the output has. Raises OutputError.

    If fewer were opened, the audio system would spread the two hands over all channels.
    """
    known = 0 if output is None else _channel_count(output)
    count = known or max(usual, hands.min_count)
    if output is not None and count < hands.min_count:
        raise OutputError(
            f"{output['name']} has {count} channel{'s' if count > 1 else ''}, but --channels gives "
            f"a hand channel {hands.min_count}; choose other channels or another output"
        )
    return count


def _playback_device(places: tuple[int, ...] | None, pulse_map: int, **settings: Any) -> Any:  # noqa: ANN401
    """Open an output with channels at these positions, named so; None is the library's order."""
    import miniaudio

    class Device(miniaudio.PlaybackDevice):  # type: ignore[misc]
        """Sets the positions between the device's settings and its opening.

        The library has no parameter for them.
        """

        def _make_context(self, *arguments: Any) -> Any:  # noqa: ANN401
            if places is not None:
                self._devconfig.pulse.channelMap = pulse_map
                self._positions = miniaudio.ffi.new("unsigned char[]", places)
                self._devconfig.playback.pChannelMap = self._positions
            return super()._make_context(*arguments)

    return Device(**settings)


def lock_memory() -> bool:
    """Keep the memory in use now from being paged out; return whether that was permitted.

    Memory that is allocated later is not locked: with a limit on locked memory, the allocation
    itself would fail then.
    """
    try:
        flags = _MCL_CURRENT | (_MCL_ONFAULT if sys.platform == "linux" else 0)
        return bool(ctypes.CDLL(None).mlockall(flags) == 0)
    except (OSError, AttributeError, TypeError):  # Windows has neither the call nor this C library
        return False
