"""A real audio output: chosen by name, opened, watched, and known to be lost when it stops asking.

No audio stack reports reliably that an output was unplugged (PulseAudio neither for a removed sink
nor for a dead server, through miniaudio), but one that is gone no longer asks for samples. What is
played, and what a loss means, is the engine's.

"jack" is a JACK server (or PipeWire's), which no list of outputs names where ALSA or PulseAudio is
there too. Through miniaudio its stream has two channels or does not open, and none of it is kept
between two periods, so that there a single period missed is audible.
"""

from __future__ import annotations

import ctypes
import functools
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.speaker.channels import (
    DUALSENSE,
    POSITIONS,
    Channels,
    is_dualsense,
)
from hapticvlm.errors import HapticVLMError
from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.vibration.vibration import RATE_HZ

BUFFERED_BLOCKS = 3  # miniaudio's default number of periods: a longer gap has emptied them all
JACK = "jack"
JACK_BLOCKS = 2  # periods between two calls, when the one between them was missed
LOST_S = 1.0
STEADY_WITHIN_S = 8.0  # PulseAudio plays up to two seconds of its own silence before it asks
STEADY_S = 0.25
_POLL_S = 0.02
_PULSE_AS_ALSA = 1  # pa_channel_map_def_t: four are front and rear, as every other system has it
_MCL_CURRENT = 1  # of <sys/mman.h>, on Linux and macOS alike

Fill = Callable[[int], NDArray[np.float32]]


class OutputError(HapticVLMError):
    """The output could not be opened; the text says why."""


@dataclass(slots=True)
class Output:
    """One open stream; `fill` is called from the audio thread and renders each block."""

    fill: Fill
    realtime: bool
    name: str = ""
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
        """Start playing on the output called `requested`. Raises OutputError."""
        import miniaudio

        is_jack = requested.lower() == JACK
        self._channels, self._max_gap_blocks = (2, JACK_BLOCKS) if is_jack else (1, BUFFERED_BLOCKS)
        try:
            found = None if is_jack else choose(playbacks(), requested)
            if self.hands is not None:
                self._channels = _channels_of(found, self.hands, self._channels)
            self._device = _playback_device(
                POSITIONS.get(self._channels),
                output_format=miniaudio.SampleFormat.FLOAT32,
                nchannels=self._channels,
                sample_rate=RATE_HZ,
                buffersize_msec=max(1, round(block * 1000 / RATE_HZ)),
                device_id=found["id"] if found else None,
                backends=[miniaudio.Backend.JACK] if is_jack else None,
                app_name="HapticVLM",
            )
            if "null" in self._device.backend.lower():
                raise OutputError("this machine has no audio output")
            stream = self._blocks()
            next(stream)
            self._device.start(stream)
        except miniaudio.MiniaudioError as error:
            self.close()
            raise OutputError(f"the audio system says {error.args[0]}") from error
        self.name = found["name"] if found else f"default output ({self._device.backend})"

    def wait_until_steady(self, beat: Callable[[], None]) -> None:
        """Wait until the output asks steadily, calling `beat` meanwhile. Raises OutputError."""
        deadline = time.monotonic() + STEADY_WITHIN_S
        before = self.requested_samples
        since = time.monotonic()
        # An output that opened may ask in bursts at first, to fill its own buffer, or not at all
        # for two seconds. Until it has asked for half of what STEADY_S plays, within STEADY_S, no
        # touch would be heard when it should be: the service is not said to be ready, and no gap
        # counts as an underrun.
        while self.requested_samples - before < STEADY_S * RATE_HZ / 2:
            beat()
            time.sleep(_POLL_S)
            now = time.monotonic()
            if now > deadline:
                self.close()
                raise OutputError(f"{self.name} opened, but asked for no samples")
            if now - since > STEADY_S:
                before = self.requested_samples
                since = now

    def is_lost(self, now: float, awake_since: float) -> bool:
        """Return whether the output has asked for no samples for LOST_S.

        `awake_since` is since when the caller has watched without a gap: while a machine sleeps no
        output asks, and none is lost.
        """
        # Two clocks can stop without a fault. The output's: PulseAudio and PipeWire ask for nothing
        # while a machine is suspended. And ours: after a suspend this process may be scheduled
        # before the sound server is. So the last request counts only as far back as the caller has
        # been awake, and an output gets a whole LOST_S after waking to ask again.
        return now - max(self.last_request_at, awake_since) > LOST_S

    def close(self) -> None:
        """Stop playing."""
        import miniaudio

        device = self._device
        self._device = None
        if device is not None:
            device.close()
            # The binding leaves the device's connection to the sound server open.
            miniaudio.lib.ma_context_uninit(device._context)

    def _blocks(self) -> Generator[NDArray[np.float32], int, None]:
        # miniaudio sends into this generator how many samples it wants and plays what is yielded.
        # It runs in a thread of the audio system, so priority is asked for here and not in open().
        # An exception would end that thread without a word: it is kept, and raised again where the
        # engine's own loop looks at it.
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
                self.failure = error  # raised again where it is handled
                raise
            count = yield self._spread(block)

    def _spread(self, block: NDArray[np.float32]) -> NDArray[np.float32]:
        """Put a block, (N,) or (N, 2) a hand each, onto the channels of the output, (N * C,)."""
        if self.hands is not None:
            return self.hands.spread(block, self._channels).ravel()
        return block if self._channels == 1 else np.repeat(block, self._channels)


def playbacks() -> list[dict[str, Any]]:
    """Return the outputs of this machine, each with its `name` and `id`."""
    import miniaudio

    _mute_alsa()
    found: list[dict[str, Any]] = miniaudio.Devices().get_playbacks()
    return found


@functools.cache
def _mute_alsa() -> object:
    """Keep ALSA from writing each way that it tries to the terminal; our errors say what counts.

    Returns the handler, which must live as long as the library may call it.
    """
    try:
        alsa = ctypes.CDLL("libasound.so.2")
    except OSError:  # no Linux, or no ALSA
        return None
    kinds = (ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p)
    handler = ctypes.CFUNCTYPE(None, *kinds)(lambda *_: None)
    alsa.snd_lib_error_set_handler(handler)
    return handler


def choose(outputs: Sequence[dict[str, Any]], requested: str) -> dict[str, Any] | None:
    """Return the output of this name, or the only one whose name has it as a part, in any case.

    None is "default", which needs only that there is one; "dualsense" is a PS5 controller, which
    systems give other names. Raises OutputError naming those there.
    """
    if requested == "default" and outputs:
        return None
    if requested.lower() == DUALSENSE:
        outputs = [output for output in outputs if is_dualsense(output["name"])]
        if not outputs:
            raise OutputError(
                "no PS5 controller is there as a sound output: connect it by USB, as Bluetooth "
                "carries no sound to it"
            )
        return outputs[0]
    called = [(output, output["name"].lower()) for output in outputs]
    exact = [output for output, name in called if name == requested.lower()]
    partly = [output for output, name in called if requested.lower() in name]
    if exact or len(partly) == 1:
        return (exact or partly)[0]
    names = ", ".join(output["name"] for output in partly or outputs) or "none"
    if partly:
        raise OutputError(f"several outputs match: {names}")
    raise OutputError(f"no such output; this machine has: {names}")


def _channels_of(found: dict[str, Any] | None, hands: Channels, usual: int) -> int:
    """Return how many channels to open: all that the output has. Raises OutputError.

    With fewer, the audio system would spread what two hands feel over the rest.
    """
    formats = [] if found is None else found["formats"]
    count = max((form["channels"] for form in formats), default=0) or max(usual, hands.min_count)
    if found is not None and count < hands.min_count:
        raise OutputError(
            f"{found['name']} has {count} channel{'s' if count > 1 else ''}, and a hand is to have "
            f"the {hands.min_count}th: see --channels"
        )
    return int(count)


def _playback_device(positions: tuple[int, ...] | None, **settings: Any) -> Any:  # noqa: ANN401
    """Open an output whose channels stand at these positions; None as the library counts them."""
    import miniaudio

    class Device(miniaudio.PlaybackDevice):  # type: ignore[misc]
        """The library takes no positions: they are set between its settings and its opening."""

        def _make_context(self, *given: Any) -> Any:  # noqa: ANN401
            if positions is not None:
                self._positions = miniaudio.ffi.new("unsigned char[]", positions)
                self._devconfig.playback.pChannelMap = self._positions
                self._devconfig.pulse.channelMap = _PULSE_AS_ALSA
            return super()._make_context(*given)

    return Device(**settings)


def lock_memory() -> bool:
    """Keep what this process uses now from being paged out; return whether that was permitted.

    Not what it will use: a limit reached later would then refuse memory instead of a lock.
    """
    try:
        return bool(ctypes.CDLL(None).mlockall(_MCL_CURRENT) == 0)
    except (OSError, AttributeError, TypeError):  # no such call, or no C library to ask, as Windows
        return False
