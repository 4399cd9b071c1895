"""The floor of an audio stack: a program that does nothing but play a click on request.

A bare miniaudio callback in a process of its own, with the block size and priority of the audio
engine, controlled by one number in shared memory. It knows no materials, no leases and no rings.
"""

from __future__ import annotations

import ctypes
import multiprocessing
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

import miniaudio
import numpy as np
from numpy.typing import NDArray

from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.vibration.vibration import RATE_HZ

if TYPE_CHECKING:
    Clicks = ctypes.Array[ctypes.c_uint64]

CLICK_S = 0.01
START_S = 60.0


@dataclass(slots=True)
class Clicker:
    """Our end of the program."""

    wanted: Clicks

    def click(self) -> None:
        """Play one click; never blocks."""
        self.wanted[0] += 1


@contextmanager
def clicker(block: int, realtime: bool) -> Iterator[Clicker]:
    """Run the program on the default output."""
    context = multiprocessing.get_context("spawn")
    wanted = context.RawArray(ctypes.c_uint64, 1)
    ours, theirs = context.Pipe()
    arguments = (wanted, block, realtime, theirs)
    process = context.Process(target=_play, args=arguments, name="hapticvlm clicks", daemon=True)
    process.start()
    theirs.close()
    try:
        if not ours.poll(START_S):
            raise RuntimeError("the bare audio program did not start")
        ours.recv()
        yield Clicker(wanted)
    finally:
        ours.close()
        process.join(5.0)
        process.kill()


def _play(wanted: Clicks, block: int, realtime: bool, control: Connection) -> None:
    device = miniaudio.PlaybackDevice(
        output_format=miniaudio.SampleFormat.FLOAT32,
        nchannels=1,
        sample_rate=RATE_HZ,
        buffersize_msec=max(1, round(block * 1000 / RATE_HZ)),
        app_name="floor",
    )
    stream = _clicks(wanted, realtime)
    next(stream)
    device.start(stream)
    control.send("playing")
    control.poll(None)
    device.close()


def _clicks(wanted: Clicks, realtime: bool) -> Generator[NDArray[np.float32], int, None]:
    count = yield np.empty(0, np.float32)
    if realtime:
        request_priority()
    played = wanted[0]
    left = 0
    while True:
        if wanted[0] != played:
            played = wanted[0]
            left = round(CLICK_S * RATE_HZ)
        block = np.zeros(count, np.float32)
        block[:left] = 0.5
        left = max(0, left - count)
        count = yield block
