"""Finds the user's cache folder, for files that can always be computed again."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def cache_folder() -> Path:
    """Return this program's cache folder, by the convention of the system; it may not exist yet."""
    home = Path.home()
    by_platform = {
        "win32": Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local")),
        "darwin": home / "Library" / "Caches",
    }
    fallback = by_platform.get(sys.platform, home / ".cache")
    return Path(os.environ.get("XDG_CACHE_HOME") or fallback) / "hapticvlm"
