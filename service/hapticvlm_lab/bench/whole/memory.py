"""Prints the memory that an encoder adds: `python -m hapticvlm_lab.bench.whole.memory lite0`."""

from __future__ import annotations

import json
import sys

import psutil

from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.storage import load_gallery


def main(name: str) -> None:
    """Load the encoder and its references; print an object with `mb`."""
    process = psutil.Process()
    before = process.memory_info().rss
    load_gallery(encoder=load_encoder(name))
    print(json.dumps({"mb": round((process.memory_info().rss - before) / 2**20, 1)}))


if __name__ == "__main__":
    main(sys.argv[1])
