"""A folder of compiled files that all passes and workers of the tests share."""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / ".pytest_cache" / "built"  # removed by `make clean`
UNUSED_S = 24 * 3600.0  # after which a build is removed


def built_once(name: str, build: Callable[[Path], object], *sources: Path) -> Path:
    """Return the folder that `build` filled from these files and folders.

    Only the first worker of the first pass builds; the others wait meanwhile. Other sources are
    another folder. A build that fails leaves no mark, so that the next worker tries it and fails
    with the same message.
    """
    import fcntl  # Unix only, as the compilers are here

    KEPT.mkdir(parents=True, exist_ok=True)
    with (KEPT / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        folder = KEPT / f"{name}-{_digest(sources)}"
        if not (folder / "done").exists():
            for old in KEPT.glob(f"{name}-*"):
                if old.stat().st_mtime < time.time() - UNUSED_S:
                    shutil.rmtree(old)
            folder.mkdir(exist_ok=True)
            build(folder)
            (folder / "done").touch()
        os.utime(folder)
    return folder


def _digest(sources: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for source in sources:
        for file in sorted(source.rglob("*")) if source.is_dir() else [source]:
            if file.is_file() and not {"build", "__pycache__"} & set(file.parts):
                name = file.relative_to(source.parent).as_posix()
                digest.update(f"{name}\0".encode() + file.read_bytes())
    return digest.hexdigest()[:16]
