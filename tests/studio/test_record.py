"""A participant's file: what is told to be kept is whole on the disk, also when that is full."""

import json
import os
import stat
import subprocess
import sys

import pytest

from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials.record import Log, events

# The file may grow to so many bytes: the kernel then takes part of a line, as a full disk does.
FULL = """
import resource, signal, sys
from pathlib import Path
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials.record import Log
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sys.dont_write_bytecode = True  # a part of it would be kept
log = Log(Path(sys.argv[1]), "P01")
resource.setrlimit(resource.RLIMIT_FSIZE, (400, resource.RLIM_INFINITY))
kept = 0
try:
    for number in range(100):
        log.add({"event": "answered", "number": number, "text": "x" * 40})
        kept += 1
except StudyError as error:
    print(kept, error, sep="|")
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
log.add({"event": "resumed"})
"""


def test_a_full_disk_is_an_error_and_every_event_that_was_kept_is_readable(tmp_path):
    pytest.importorskip("resource", reason="limits of a process, which Windows lacks")
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path)], capture_output=True, text=True, check=True
    )
    kept, text = done.stdout.strip().split("|")
    assert int(kept) >= 3
    assert "P01.jsonl could not be written" in text
    assert "free some space" in text
    found = events(tmp_path, "P01")
    assert [event.get("number") for event in found] == [*range(int(kept)), None]
    assert found[-1]["event"] == "resumed"


def test_each_event_is_flushed_to_the_disk_before_it_counts_as_kept(tmp_path, monkeypatch):
    flushed: list[int] = []  # bytes of the file at each flush
    fsync = os.fsync

    def note(descriptor):
        fsync(descriptor)
        flushed.append(os.fstat(descriptor).st_size)

    monkeypatch.setattr(os, "fsync", note)
    log = Log(tmp_path, "P01")
    # The empty file, then its name in the folder, then the folder's own.
    assert flushed == [0, tmp_path.stat().st_size, tmp_path.parent.stat().st_size]
    for number in range(3):
        log.add({"event": "answered", "number": number})
        assert flushed[-1] == (tmp_path / "P01.jsonl").stat().st_size
    log.close()
    assert flushed[3:] == sorted(set(flushed[3:]))


@pytest.mark.parametrize("how", ["moved", "emptied", "replaced"])
def test_no_answer_is_kept_in_a_file_that_another_program_has_changed(tmp_path, how):
    path, log = tmp_path / "P01.jsonl", Log(tmp_path, "P01")
    log.add({"event": "answered", "number": 1})
    before = path.read_bytes()
    if how != "emptied":
        path.rename(tmp_path / "P01.jsonl.1")
    if how != "moved":
        path.write_bytes(before if how == "replaced" else b"")
    with pytest.raises(StudyError, match=r"P01\.jsonl was moved or changed by another program"):
        log.add({"event": "answered", "number": 2})
    log.close()


def test_a_torn_line_in_the_middle_leaves_every_other_event_readable(tmp_path):
    whole = json.dumps({"event": "answered", "number": 1})
    path = tmp_path / "P01.jsonl"
    path.write_text(f'{whole}\n{{"event": "answ{whole}\n{whole}\n', encoding="utf-8")
    assert len(events(tmp_path, "P01")) == 2


def test_a_file_that_somebody_changed_is_refused_by_its_line(tmp_path):
    (tmp_path / "P01.jsonl").write_text('{"event": "a"}\nhello\n', encoding="utf-8")
    with pytest.raises(StudyError, match=r"P01\.jsonl:2"):
        events(tmp_path, "P01")


def test_only_this_user_may_read_what_a_participant_told(tmp_path):
    Log(tmp_path, "P01").close()
    assert stat.S_IMODE((tmp_path / "P01.jsonl").stat().st_mode) == 0o600


@pytest.mark.parametrize("number", [float("inf"), float("nan")])
def test_what_is_no_number_is_never_written(tmp_path, number):
    log = Log(tmp_path, "P01")
    with pytest.raises(ValueError, match="JSON"):
        log.add({"event": "answered", "seen_ms": number})
    log.close()
    assert events(tmp_path, "P01") == []
