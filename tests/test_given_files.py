"""Tests every command that reads a file: a bad file is refused quickly, and nothing hangs."""

from __future__ import annotations

import argparse
import errno
import os
import stat
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from hapticvlm import documents
from hapticvlm.captures.lines import CaptureError, Line
from hapticvlm.commands import flash
from hapticvlm.devices.speaker.audio import WavFile
from hapticvlm.errors import CURES, HapticVLMError
from hapticvlm.recordings.session_log import read_session_log
from hapticvlm.scenes.reading import read_scene
from hapticvlm.server import options
from hapticvlm.server.web import certificate
from hapticvlm.vision import files
from hapticvlm.vision.encoders import file_encoder, networks, onnx_encoder
from hapticvlm_studio.calibration import speaker_response
from hapticvlm_studio.evaluation import pictures as labelled

SOON_S = 5.0  # half of what a slow read may take: these are refused, not given up


def session(path: Path) -> object:
    log = path.parent / "session.jsonl"
    path.rename(log)
    return list(read_session_log(log.parent))


def weights(path: Path) -> object:
    path.rename(path.parent / "model.safetensors")
    return networks.label(path.parent)


def graph(path: Path) -> object:
    path.rename(path.parent / onnx_encoder.GRAPH)
    card = onnx_encoder.Card.__new__(onnx_encoder.Card)
    return onnx_encoder._read_graph(path.parent, card)


DOORS: dict[str, Callable[[Path], object]] = {
    "--tls-cert": lambda path: certificate._require(path, "--tls-cert", "BEGIN", "certificate"),
    "a calibration": lambda path: options.plate_resistance(str(path)),
    "a picture": files._read,
    "a capture's picture": lambda path: Line(0.0, "frame", {}, file=path).message(),
    "a capture's mask": lambda path: Line(0.0, "frame", {}, mask_file=path).message(),
    "a session": session,
    "a network's file": file_encoder._read,
    "a network's weights": weights,
    "an encoder's graph": graph,
    "firmware": flash.read,
    "a table of pictures": labelled.read_pictures,
    "a picture of a table": lambda path: labelled.read_picture(
        labelled.LabelledPicture(path, 20.0)
    ),
    "a scene": read_scene,
    "an accelerometer's record": speaker_response.read_csv,
    "a sound to write": WavFile,
    "a file to write": lambda path: documents.replace_file(path, "new"),
}
KINDS = ("a fifo", "a folder", "a device")


def made(kind: str, path: Path) -> Path:
    if kind == "a fifo":
        os.mkfifo(path)
    elif kind == "a folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero")
    return path


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no fifo")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("door", DOORS)
def test_what_is_no_file_is_refused_at_once(door: str, kind: str, tmp_path: Path) -> None:
    outcomes: list[BaseException | object] = []
    path = made(kind, tmp_path / "given")

    def enter() -> None:
        try:
            outcomes.append(DOORS[door](path))
        except BaseException as error:  # noqa: BLE001 - looked at below
            outcomes.append(error)

    thread = threading.Thread(target=enter, daemon=True)
    thread.start()
    thread.join(SOON_S)
    assert outcomes, f"{door} still waits for {kind}"
    error = outcomes[0]
    assert isinstance(error, OSError | ValueError | HapticVLMError | argparse.ArgumentTypeError)
    assert "regular file" in str(error) or "a folder" in str(error), error


def test_too_large_a_file_is_named_with_the_limit(tmp_path: Path) -> None:
    path = tmp_path / "large.jpg"
    with path.open("wb") as file:
        file.truncate(files.MAX_BYTES + 1)
    with pytest.raises(files.FileError, match=r"large\.jpg: larger than 64 MiB, .*shorten"):
        files._read(path)
    with path.open("wb") as file:
        file.truncate(documents.MAX_BYTES + 1)
    with pytest.raises(CaptureError, match=r"large\.jpg: larger than 16 MiB"):
        Line(0.0, "frame", {}, file=path).message()


def test_a_disk_too_slow_is_named_with_what_came(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "slow"
    path.write_bytes(bytes(64))
    monkeypatch.setattr(documents, "PIECE_BYTES", 1)
    with pytest.raises(OSError, match=r"only \d+ bytes were read within 0 s; copy it") as caught:
        documents.read_bytes(path, timeout_s=0.0)
    assert caught.value.filename == str(path)


def test_what_is_written_is_on_the_disk_before_it_takes_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "study.json"
    path.write_text("before")
    path.chmod(0o600)
    synced: list[tuple[int, str]] = []
    to_disk = os.fsync

    def noting(number: int) -> None:
        state = os.fstat(number)
        synced.append((0 if stat.S_ISDIR(state.st_mode) else state.st_size, path.read_text()))
        to_disk(number)

    monkeypatch.setattr(os, "fsync", noting)
    documents.replace_file(path, b"after that")
    folders = [] if os.name == "nt" else [(0, "after that")]  # the new name, too
    assert synced == [(len("after that"), "before"), *folders]
    assert [found.name for found in tmp_path.iterdir()] == ["study.json"]
    assert os.name == "nt" or stat.S_IMODE(path.stat().st_mode) == 0o600


# Python keeps a part of a module's bytecode on a disk that fills up, and other tests would read it.
FULL = """
import resource, sys
from hapticvlm.commands.main import main
sys.dont_write_bytecode = True
resource.setrlimit(resource.RLIMIT_FSIZE, (100, resource.RLIM_INFINITY))
for words in sys.stdin.read().splitlines():
    print(main(words.split()))
"""


def test_each_command_says_which_file_a_full_disk_refused_and_leaves_no_part_of_it(
    tmp_path: Path,
) -> None:
    pytest.importorskip("resource", reason="limits of a process, which Windows lacks")
    commands = {
        "feel metal --save": "felt.svg",
        "feel wood --save": "felt.wav",
        "study new": "study",
        "study report --paper --out": "report",
        "calibrate speaker --simulate --out": "speaker.csv",
    }
    lines = "\n".join(f"{words} {tmp_path / name}" for words, name in commands.items())
    done = subprocess.run(
        [sys.executable, "-c", FULL], input=lines, capture_output=True, text=True, check=True
    )
    said = [line for line in done.stderr.splitlines() if line.startswith("hapticvlm ")]
    for line, name in zip(said, commands.values(), strict=True):
        assert line.endswith(f": File too large; {CURES[errno.EFBIG]}")
        assert str(tmp_path / name) in line
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
