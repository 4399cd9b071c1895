"""With --json commands print one JSON object, also for an error; without it they print text."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from each_case import each_row
from in_process import hapticvlm
from pace import PACE
from ports import free_port
from tiers import nightly_except
from word_tables import words

ROOT = Path(__file__).parents[2]
NOWHERE = "ws://127.0.0.1:1/"
REFUSED = words(Path(__file__).with_name("wrong_files.csv"), "json")


@each_row(("command",), REFUSED)
def test_a_refusal_is_one_line_for_people_and_one_object_for_programs(command, tmp_path):
    said = hapticvlm(*command.split(), cwd=tmp_path)
    assert said.code == 2
    assert said.out in ("", "hapticvlm demo: loading\n")
    (line,) = said.err.splitlines()
    told = hapticvlm(*command.split(), "--json", cwd=tmp_path)
    assert (told.code, told.err) == (2, "")
    error = json.loads(told.out)["error"]
    assert line.endswith(error)


def test_the_contents_of_a_gallery_are_printed_as_json():
    told = json.loads(hapticvlm("gallery", "list", "--json").out)
    assert told["gallery"] == "shipped"
    assert {row["material"] for row in told["materials"]} >= {"wood", "glass", "fabric", "metal"}
    assert all(row["references"] > 0 for row in told["materials"])


def test_a_name_like_no_other_is_not_taken_for_another(tmp_path):
    said = hapticvlm("feel", "gold", cwd=tmp_path).err
    assert "`gold`" in said
    assert "nearest" not in said
    assert "nearest is `wood`" in hapticvlm("feel", "woood", cwd=tmp_path).err


def test_the_smallest_scene_says_how_to_start_the_service_that_it_lacks():
    touch = [sys.executable, str(ROOT / "examples" / "touch.py"), NOWHERE]
    said = subprocess.run(touch, capture_output=True, text=True, check=False)
    assert said.returncode == 1
    assert "`hapticvlm serve` starts one" in said.stderr
    assert "Traceback" not in said.stderr


INTERRUPTIBLE = """
import sys
from hapticvlm.__main__ import run
print("begun", flush=True)
sys.exit(run())
"""
INTERRUPTED_AT = """
import os, signal, sys
lines = 0
def trace(frame, event, _):
    global lines
    ours = frame.f_code.co_filename.endswith(os.path.join("hapticvlm", "__main__.py"))
    if ours and frame.f_code.co_name == "run":
        def count(frame, event, _):
            global lines
            lines += event == "line"
            if lines == {line}:
                sys.settrace(None)
                os.kill(os.getpid(), signal.SIGINT)
            return count
        sys.settrace(lambda frame, event, _: count)
        return count
sys.settrace(trace)
"""


def doctor_after(modules):
    """Run `hapticvlm doctor`, which imports the modules of this folder before any other."""
    folders = os.pathsep.join([str(modules), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-m", "hapticvlm", "doctor"],
        env={**os.environ, "PYTHONPATH": folders},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("line", nightly_except(5, [*range(1, 12), 15, 20, 30, 50, 100, 200, 400]))
@pytest.mark.skipif(os.name == "nt", reason="a process is interrupted otherwise there")
def test_ctrl_c_leaves_no_traceback_at_any_of_the_first_lines_of_ours(line, tmp_path):
    (tmp_path / "sitecustomize.py").write_text(INTERRUPTED_AT.replace("{line}", str(line)))
    said = doctor_after(tmp_path)
    assert said.returncode in (130, -signal.SIGINT)
    assert "Traceback" not in said.stderr


def test_ctrl_c_leaves_no_traceback_during_the_very_first_import(tmp_path):
    (tmp_path / "signal.py").write_text("raise KeyboardInterrupt\n")
    said = doctor_after(tmp_path)
    assert (said.returncode, said.stdout, said.stderr) == (130, "", "")


@pytest.mark.nightly
@pytest.mark.parametrize("after_s", [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0])
@pytest.mark.parametrize(
    "command", [["serve"], ["serve", "--record", "sessions"]], ids=["serve", "record"]
)
@pytest.mark.skipif(os.name == "nt", reason="a process is interrupted otherwise there")
def test_ctrl_c_of_a_terminal_stops_a_service_that_starts_with_all_its_processes(
    tmp_path, command, after_s
):
    with subprocess.Popen(
        [sys.executable, "-c", INTERRUPTIBLE, *command, "--port", str(free_port())],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as service:
        assert service.stdout is not None
        service.stdout.readline()
        time.sleep(after_s)
        os.killpg(service.pid, signal.SIGINT)
        said = service.communicate(timeout=60 * PACE)[0]  # which ends with the last process
    assert "Traceback" not in said
    assert service.returncode in (0, 130, -signal.SIGINT)


LOST_IN_A_DESTRUCTOR = """
import os, signal, sys, time
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "hapticvlm.doctor":
            sys.meta_path.remove(self)
            Interrupted()
class Interrupted:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)
sys.meta_path.insert(0, Finder())
"""


@pytest.mark.skipif(os.name == "nt", reason="a process is interrupted otherwise there")
def test_ctrl_c_is_not_lost_where_python_cannot_raise_it(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(LOST_IN_A_DESTRUCTOR)
    said = doctor_after(tmp_path)
    assert said.returncode in (130, -signal.SIGINT)
    assert "Traceback" not in said.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="ALSA is Linux's")
def test_alsa_writes_nothing_to_the_terminal_while_outputs_are_sought():
    look = "from hapticvlm.devices.speaker.output import playbacks; playbacks()"
    said = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=False)
    assert "ALSA" not in said.stderr
