"""The ZIP that a page saves of a touch: picture, sound, haptic files and a page, each readable."""

from __future__ import annotations

import io
import json
import re
import wave
import zipfile
from pathlib import Path

import numpy as np
from PIL import Image


def unpacked(path: Path) -> dict[str, bytes]:
    """Return the files by the end of their names, once each is checked."""
    archive = zipfile.ZipFile(path)
    assert archive.testzip() is None
    files = {name.rsplit(".", 1)[1]: archive.read(name) for name in archive.namelist()}
    assert set(files) == {"png", "wav", "haptic", "ahap", "html"}
    assert Image.open(io.BytesIO(files["png"])).width >= 960
    with wave.open(io.BytesIO(files["wav"])) as sound:
        assert (sound.getsampwidth(), sound.getnchannels()) == (2, 1)
        heard = np.frombuffer(sound.readframes(sound.getnframes()), "<i2")
    assert np.abs(heard).max() > 1000
    envelopes = json.loads(files["haptic"])["signals"]["continuous"]["envelopes"]
    assert max(point["amplitude"] for point in envelopes["amplitude"]) > 0
    assert json.loads(files["ahap"])["Version"] == 1
    document = files["html"].decode()
    assert "data:image/png;base64," in document
    assert "data:audio/wav;base64," in document
    assert re.findall(r'(?:src|href)="(?!data:)', document) == []  # nothing else is needed
    return files
