"""Tests of what Python frees at once, without looking for reference cycles."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def no_collection() -> Iterator[None]:
    """Keep Python from looking for reference cycles by itself."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
