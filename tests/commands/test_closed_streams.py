"""The program works without stdin, stdout or stderr: service managers and `pythonw` close them."""

import ast
import os
import signal
import subprocess
import sys
import urllib.request
from itertools import product
from pathlib import Path

import pytest
from pace import PACE, until
from ports import free_port
from tiers import nightly_except

from hapticvlm.commands.main import main

# Uses every stream and opens a file. Reports the devices at descriptors 0 to 2, here and in a
# child process, and the descriptor of the file.
USING = """
import os, subprocess, sys
from hapticvlm.standard_streams import open_missing

open_missing()
sys.stdin.read(), sys.stdout.isatty(), sys.stdout.flush(), sys.stderr.isatty(), print("printed")
file = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
look = "import os, sys; open(sys.argv[1], 'w').write(repr([os.fstat(n).st_rdev for n in range(3)]))"
subprocess.run([sys.executable, "-c", look, sys.argv[2]], check=True)
here = [os.fstat(n).st_rdev for n in range(3)]
os.write(file, repr((here, file)).encode())
"""
WITHOUT_STREAMS = """
import sys
sys.stdin = sys.stdout = sys.stderr = None  # as under pythonw
from hapticvlm.__main__ import run

sys.exit(run())
"""

posix = pytest.mark.skipif(os.name == "nt", reason="the shell of Windows closes no stream")


def closing(descriptors, *arguments):
    """Return the command line of Python with these of its standard streams closed."""
    closed = " ".join(f"{descriptor}>&-" for descriptor in descriptors)
    return ["sh", "-c", f'exec "$0" "$@" {closed}', sys.executable, *arguments]


@posix
@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 1, 2)])
def test_a_closed_stream_is_the_null_device_here_and_in_child_processes(closed, tmp_path):
    null = Path(os.devnull).stat().st_rdev
    command = closing(closed, "-c", USING, str(tmp_path / "file"), str(tmp_path / "child"))
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=-1, stderr=-1, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    here, file = ast.literal_eval((tmp_path / "file").read_text())
    in_child = ast.literal_eval((tmp_path / "child").read_text())
    assert [here[n] for n in closed] == [in_child[n] for n in closed] == [null] * len(closed)
    assert file > 2


def test_a_command_ends_well_where_python_has_no_streams_at_all(tmp_path):
    wav = tmp_path / "metal.wav"
    command = [sys.executable, "-c", WITHOUT_STREAMS, "feel", "metal", "--save", str(wav)]
    assert subprocess.run(command, check=False).returncode == 0
    assert wav.stat().st_size > 44


@posix
def test_the_service_runs_without_stderr():
    port = free_port()
    service = subprocess.Popen(closing((2,), "-m", "hapticvlm", "serve", "--port", str(port)))
    try:
        until(lambda: service.poll() is not None or is_ready(port))
        assert service.poll() is None
        assert main(["stop", "--url", f"ws://127.0.0.1:{port}/"]) == 0  # the service logs a line
    finally:
        service.send_signal(signal.SIGTERM)
        assert service.wait(30 * PACE) == 0


def is_ready(port):
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=5) as page:
            return page.status == 200
    except OSError:
        return False


@posix
@pytest.mark.parametrize("command", ["serve --port 0", "feel wood", "gallery list"])
def test_a_command_whose_reader_has_left_ends_without_a_word(command):
    reader, writer = os.pipe()
    os.close(reader)
    words = [sys.executable, "-m", "hapticvlm", *command.split()]
    done = subprocess.run(words, stdout=writer, stderr=-1, check=False, timeout=60 * PACE)
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a device that is full")
@pytest.mark.parametrize(
    ("unbuffered", "command"),
    nightly_except(3, product(("", "1"), ("gallery list", "", "serve --help", "--version"))),
)
def test_a_command_whose_disk_is_full_says_so_and_ends_alike_where_it_cannot(command, unbuffered):
    words = [sys.executable, "-m", "hapticvlm", *command.split()]
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, stdout=full, stderr=-1, env=environment, check=False)
        assert (done.returncode, done.stderr.count(b"\n")) == (2, 1)
        assert b"free some space" in done.stderr
        done = subprocess.run(words, stdout=full, stderr=full, env=environment, check=False)
        assert done.returncode == 2
