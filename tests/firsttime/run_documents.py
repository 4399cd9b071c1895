"""Runs every command that the documents show, in a clean shell and a fresh environment.

    python tests/firsttime/run_documents.py            # makes the environment; about a minute
    python tests/firsttime/run_documents.py --list     # what is run, and why the rest is not

Fails at the first command that does not work as it is written. A service is stopped as soon as it
is ready, and gets `--port 0`, so that it is in nobody's way.
"""

from __future__ import annotations

import argparse
import collections
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from blocks import PLACES, ROOT, Command, shown

sys.path.append(str(ROOT / "tests" / "support"))

from gltf_room import write_room
from PIL import Image

PATIENCE_S = 300.0
SERVES = re.compile(r"hapticvlm (?:--\S+ \S+ )*serve\b")
SCENE = {"type": "scene", "id": 1, "objects": [{"object_id": "oak_table"}], "replace": True}
HEADSET = ROOT / "service" / "hapticvlm" / "demo" / "capture" / "frames"


def install(folder: Path) -> Path:
    """Make a fresh environment with this checkout's package; return where its programs are."""
    environment = folder / "environment"
    constraints = ["-c", str(ROOT / "constraints.txt")]
    uv = shutil.which("uv")
    if uv is not None:
        subprocess.run([uv, "venv", "-q", "--python", sys.executable, environment], check=True)
        programs = environment / ("Scripts" if os.name == "nt" else "bin")
        where = ["--python", str(programs / "python")]
        subprocess.run([uv, "pip", "install", "-q", *where, *constraints, str(ROOT)], check=True)
        return programs
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    programs = environment / ("Scripts" if os.name == "nt" else "bin")
    pip = [sys.executable, "-m", "pip", "--python", str(programs / "python"), "install", "-q"]
    subprocess.run([*pip, "--disable-pip-version-check", *constraints, str(ROOT)], check=True)
    return programs


def furnish(folder: Path) -> None:
    """Lay out what the documents take for granted: a reader's pictures, scenes and examples."""
    folder.mkdir()
    frames = sorted(HEADSET.glob("*.jpg"))
    shutil.copy(frames[0], folder / "photo.jpg")
    rooms = {"frames": 0, "masks": 0, "walnut": 8, "pictures/wood": 16, "pictures/glass": 24}
    rooms |= {"other-pictures/wood": 19, "other-pictures/glass": 27}
    for name, first in rooms.items():
        (folder / name).mkdir(parents=True)
        for frame in frames[first : first + 3]:
            if name != "masks":
                shutil.copy(frame, folder / name)
    write_room(folder / "room.glb")
    write_room(folder / "scenes" / "room.glb")
    (folder / "scene.json").write_text(json.dumps(SCENE))
    stated = {"objects": [{"object_id": "oak_table", "material": "wood"}]}
    (folder / "stated.json").write_text(json.dumps(stated))
    shutil.copy(ROOT / "examples" / "hapticvlm.toml", folder)
    with Image.open(frames[0]) as picture:
        for name in ("planks_basecolor.png", "atlas.png"):
            picture.save(folder / name)
    for name in ("examples", "firmware", "schemas", "service", "tests"):
        (folder / name).symlink_to(ROOT / name)


def record(folder: Path, programs: Path) -> None:
    """Record a session by the demo, as a reader has after `hapticvlm serve --record`."""
    with tempfile.TemporaryDirectory() as name:
        shown = subprocess.run(
            [programs / "hapticvlm", "demo", "--out", name], capture_output=True, check=True
        )
        (session,) = Path(name, "session").iterdir()
        shutil.copytree(session, folder)
        assert shown.stdout


def run(command: Command, folder: Path, programs: Path) -> str | None:
    """Run one command; return what went wrong, or None."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    clean = {**kept, "PATH": f"{programs}{os.pathsep}{kept['PATH']}", "PYTHONUNBUFFERED": "1"}
    does_serve = SERVES.search(command.text) is not None
    text = f"{command.setting}{command.text}{' --port 0' if does_serve else ''}"
    shell = ["bash", "--noprofile", "--norc", "-e", "-c", text]
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(
            shell, cwd=folder, env=clean, stdout=output, stderr=subprocess.STDOUT,
            start_new_session=True,
        )  # fmt: skip
        wanted = "ready on" if does_serve else None
        said = _wait(process, output.fileno(), wanted)
    if wanted is not None:
        return None if wanted in said else said
    return said if process.returncode else None


def _wait(process: subprocess.Popen[bytes], output: int, wanted: str | None) -> str:
    """Wait for the end, or for what is wanted and end it; return all that was said."""
    until = time.monotonic() + PATIENCE_S
    while process.poll() is None and time.monotonic() < until:
        if wanted is not None and wanted in _said(output):
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(PATIENCE_S)
        time.sleep(0.05)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return f"no end after {PATIENCE_S:.0f} s: {_said(output)}"
    return _said(output)


def _said(output: int) -> str:
    return os.pread(output, 1_000_000, 0).decode(errors="replace")


def main() -> int:
    """Run all, or list them; return 1 at the first that does not work."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="only list the commands")
    parser.add_argument("--programs", type=Path, help="an environment's bin folder (a fresh one)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        started = time.monotonic()
        programs = options.programs
        if programs is None and not options.list:
            programs = install(folder)
            print(f"installed in {time.monotonic() - started:.0f} s", flush=True)
        if not options.list:
            record(folder / "record", programs)
        counts: collections.Counter[str] = collections.Counter()
        for command in shown():
            counts[command.reason or "run"] += 1
            if command.reason is not None or options.list:
                print(f"{'not run' if command.reason else 'run':<8}{command.place:<32}"
                      f"{command.text[:60]:<62}{command.reason or ''}", flush=True)  # fmt: skip
                continue
            place = folder / command.folder.replace("/", "-")
            if not place.is_dir():
                furnish(place)
                shutil.copytree(folder / "record", place / PLACES["SESSION"])
                shutil.copytree(folder / "record", place / "demo-output" / "session" / "1")
            wrong = run(command, place, programs)
            print(f"{'FAILED' if wrong else 'ok':<8}{command.place:<32}{command.text}", flush=True)
            if wrong:
                print(wrong)
                return 1
        print(f"{counts.total()} commands, {counts.pop('run')} of them run, the others not:")
        for reason, number in counts.most_common():
            print(f"{number:>4}  {reason}")
        print(f"{time.monotonic() - started:.0f} s in all")
    return 0


if __name__ == "__main__":
    sys.exit(main())
