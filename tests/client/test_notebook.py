"""A service and a connection of a notebook: Interrupt, cells, threads, forks, dropped objects."""

import gc
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from functools import partial

import pytest
from pace import PACE, until

import hapticvlm

SOON_S = 30.0 * PACE
# A cell that is interrupted while it touches, and the next one; the whole group gets the signal.
INTERRUPTED = """
import os, signal, sys, threading, hapticvlm
service = hapticvlm.serve()
client = hapticvlm.connect_blocking(service.url)
client.scene([{"object_id": "cup", "material": "ceramic"}])
for where in ("touching", "request", "serve", "nothing"):
    threading.Timer(0.3, os.killpg, (os.getpgid(0), signal.SIGINT)).start()
    try:
        if where == "touching":
            with client.touching("cup"):
                threading.Event().wait()
        elif where == "request":
            while True:
                client.touch("contact", "cup")
        elif where == "serve":
            while True:
                with hapticvlm.serve():
                    threading.Event().wait()
        else:
            threading.Event().wait()
    except KeyboardInterrupt:
        pass
    print(where, client.touch("contact", "cup")["type"], service.process.poll(), flush=True)
"""
OWNER = """
import sys, time, hapticvlm
service = hapticvlm.serve()
print(service.process.pid, flush=True)
time.sleep(3600)
"""

pytestmark = pytest.mark.process


@pytest.mark.skipif(os.name != "posix", reason="groups of processes of POSIX")
def test_an_interrupt_wherever_it_falls_leaves_the_service_running():
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED],
        capture_output=True,
        text=True,
        timeout=SOON_S * 4,
        start_new_session=True,
        check=False,
    )
    said = [f"{where} ok None" for where in ("touching", "request", "serve", "nothing")]
    assert done.stdout.splitlines() == said, done.stderr


@pytest.mark.skipif(os.name != "posix", reason="a process that is killed")
def test_a_service_ends_when_its_owner_is_killed():
    owner = subprocess.Popen([sys.executable, "-c", OWNER], stdout=subprocess.PIPE, text=True)
    assert owner.stdout is not None
    with owner.stdout:
        pid = int(owner.stdout.readline())
        owner.kill()
        owner.wait()
    until(lambda: not runs(pid))


def test_a_service_outlives_the_thread_that_began_it_and_every_use_of_a_closed_one_says_so():
    begun = []
    thread = threading.Thread(target=lambda: begun.append(hapticvlm.serve()))
    thread.start()
    thread.join()
    (service,) = begun
    client = hapticvlm.connect_blocking(service.url)
    assert client.scene([{"object_id": "cup"}])["type"] == "ok"
    with pytest.raises(hapticvlm.HapticVLMError, match="no event `view`"):
        client.next_event("view", seconds=0.01)
    until(lambda: not client._client.events.empty())  # telemetry that is told before the end
    service.process.kill()
    service.process.wait()
    for use in (client.stop, client.events, lambda: client.touch("contact", "cup")):
        with pytest.raises(hapticvlm.HapticVLMError, match="start it by `hapticvlm serve`"):
            until(partial(calls, use))  # events may have come before the end
    client.close()
    with pytest.raises(hapticvlm.HapticVLMError, match="open another"):
        client.stop()
    with pytest.raises(hapticvlm.HapticVLMError, match="nothing listens there"):
        hapticvlm.connect_blocking(service.url)
    service.stop()


def calls(use):
    """Call, and say that it did not help."""
    use()
    return False


def test_a_connection_that_is_dropped_ends_with_its_thread_and_frees_the_outputs():
    with hapticvlm.serve() as service:
        client = hapticvlm.connect_blocking(service.url, name="dropped")
        assert client.welcome["owner"]
        del client
        gc.collect()
        until(lambda: all(thread.name != "dropped" for thread in threading.enumerate()))
        with hapticvlm.connect_blocking(service.url) as other:
            assert other.welcome["owner"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a fork")
def test_a_forked_process_is_told_that_the_connection_is_anothers():
    with hapticvlm.serve() as service, hapticvlm.connect_blocking(service.url) as client:
        child = multiprocessing.get_context("fork").Process(target=use_of_anothers, args=(client,))
        child.start()
        child.join(SOON_S)
        assert child.exitcode == 0
        assert client.scene([{"object_id": "cup"}])["type"] == "ok"


def use_of_anothers(client):
    """Exit with 0 if a call fails in words."""
    try:
        client.stop()
    except hapticvlm.HapticVLMError as error:
        os._exit("another process" not in str(error))


def runs(pid):
    try:
        os.kill(pid, signal.SIG_DFL)
    except ProcessLookupError:
        return False
    return True
