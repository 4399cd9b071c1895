"""Where this program keeps what it can always make anew: the user's cache folder."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def cache_folder() -> Path:
    """Return the user's cache folder for this program, as each system has it."""
    home = Path.home()
    usual = {
        "win32": Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local")),
        "darwin": home / "Library" / "Caches",
    }
    fallback = usual.get(sys.platform, home / ".cache")
    return Path(os.environ.get("XDG_CACHE_HOME") or fallback) / "hapticvlm"
