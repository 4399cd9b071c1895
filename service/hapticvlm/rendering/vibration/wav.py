"""Encodes a wave as a WAV file, 16-bit mono, which every player reads."""

from __future__ import annotations

import io
import wave
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.rendering.vibration.vibration import RATE_HZ


def encoded(samples: NDArray[np.floating], rate_hz: int = RATE_HZ) -> bytes:
    """Return a wave (N,) as a WAV file; samples beyond -1..1 are clipped."""
    raw = io.BytesIO()
    with wave.open(raw, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate_hz)
        file.writeframes(np.rint(np.clip(samples, -1.0, 1.0) * 32767.0).astype("<i2").tobytes())
    return raw.getvalue()


def write(path: Path, samples: NDArray[np.float32]) -> None:
    """Write (N,) float32 at RATE_HZ. Raises OSError."""
    documents.replace_file(path, encoded(samples))
