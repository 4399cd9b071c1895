"""Plant defects in leases, ownership, limits, origins: `python tests/server/mutate.py [NUMBER ...]`.

Each is planted alone in a copy of the package and must be caught by the test named with it. A
defect that no longer fits the source is an error: the list follows the code.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
GATEWAY, BUDGETS = "tests/server/test_gateway.py", "tests/server/test_budgets.py"
HTTP, SESSION = "tests/server/test_http.py", "tests/session/test_session.py"
PLATE, AUDIO = "tests/devices/test_plate_session.py", "tests/devices/test_audio.py"
CHILD = "tests/processes/test_supervised.py"
PHASES, REQUEST = "tests/server/test_phases.py", "tests/server/test_request.py"
SCENES = "tests/server/test_scene_files.py"
FRAMES = "tests/vision/test_frame_recogniser.py"
EDGE, RANDOM = "tests/server/test_edge.py", "tests/lab/test_invariants.py"


@dataclass(frozen=True)
class Defect:
    """What is planted where, and which test catches it."""

    file: str
    sound: str
    planted: str
    test: str


DEFECTS = (
    # ownership
    Defect("server/ownership.py", "if idle_s < IDLE_OWNER_S:", "if False:", f"{GATEWAY} -k lately"),
    Defect("server/ownership.py", "        owner.session.set_owner(owner=False)", "        pass", f"{GATEWAY} -k idle"),
    Defect("server/ownership.py", "        if requester.session.observer:", "        if False:", f"{GATEWAY} -k never"),
    Defect("server/ownership.py", "        self.owner = None\n        self._outputs", "        self._outputs", f"{GATEWAY} -k nobody_owns"),
    Defect("server/ownership.py", "        if connection.session.owner:", "        if True:", f"{GATEWAY} -k first_scene"),
    Defect("server/ownership.py", "        self._notify()\n", "        pass\n", f"{GATEWAY} -k offered"),
    Defect("server/ownership.py", "not self.owner.is_open:", "False:", f"{GATEWAY} -k closing"),
    Defect("server/ownership.py", "            self._vibration.rest()\n            self._vibration.end()\n", "", f"{GATEWAY} -k who_lost"),
    Defect("server/gateway.py", "if not observer.is_local:", "if False:", f"{GATEWAY} -k states_materials"),
    # the record
    Defect("recordings/recorder.py", "if written != len(data):", "if False:", "tests/recordings/test_recorder.py -k disk_cuts"),
    # fair shares
    Defect("server/recognition_queue.py", "not connection.session.owner)", "False)", f"{GATEWAY} -k come_first"),
    Defect("server/recognition_queue.py", "session.is_uncached(request) or rate.spend(1.0, now)", "True", "tests/server/test_server.py -k before_its_time"),
    Defect("server/recognition_queue.py", "session.is_uncached(request) or rate.spend(1.0, now)", "rate.spend(1.0, now)", "tests/server/test_gateway.py -k never_seen"),
    Defect("server/supervision.py", "if self._gateway.recognition.is_waiting:", "if False:", "tests/server/test_server.py -k before_its_time"),
    Defect("server/recognition_queue.py", "if waiting + size > ENROL_BYTES:", "if False:", f"{GATEWAY} -k one_budget"),
    Defect("server/recognition_queue.py", "VIEW_S = 0.5", "VIEW_S = 0.05", f"{GATEWAY} -k twice_a_second"),
    Defect("vision/frame_recogniser.py", "MAX_LAST_PICTURES = 1024", "MAX_LAST_PICTURES = 10240", f"{FRAMES} -k last_pictures"),
    Defect("vision/frame_recogniser.py", "MAX_TAUGHT_SCENES = 16", "MAX_TAUGHT_SCENES = 160", f"{FRAMES} -k 16_scenes"),
    # limits
    Defect("server/edge/limits.py", "if amount > self._left:", "if False:", f"{BUDGETS} -k burst"),
    Defect("server/edge/limits.py", "min(self._rate.burst, self._left + gained)", "self._left + gained", f"{BUDGETS} -k never_holds"),
    Defect("server/edge/limits.py", "max(0.0, now - self._at)", "abs(now - self._at)", f"{BUDGETS} -k never_holds"),
    Defect("server/edge/limiter.py", "oldest.transport.abort()", "pass", f"{BUDGETS} -k longest"),
    Defect("server/edge/limiter.py", "self._admitted.add(socket)", "pass", f"{BUDGETS} -k newcomer"),
    Defect("server/edge/limiter.py", "self._waiting[socket] = now + ASKED_S", "pass", f"{BUDGETS} -k spared"),
    Defect("server/handshake.py", "if each.is_idle)", "if False)", "tests/server/test_handshake.py -k make_room"),
    # the edge
    Defect("server/edge/listener.py", "        await asyncio.sleep(0)", "        pass", f"{EDGE} -k one_is_taken"),
    Defect("server/edge/socket.py", "may_process = self.is_writable or self._has_ended", "may_process = True", f"{EDGE} -k reads_nothing"),
    Defect("server/edge/socket.py", "self._short if size <= READ_BYTES", "self._short if True", f"{EDGE} -k long_frame"),
    Defect("server/edge/socket.py", "self._loop.call_soon(self._take_turn)", "self._take_turn()", f"{EDGE} -k one_a_turn"),
    Defect("server/web/http.py", "if self.is_open_to_own_pages_only:", "if False:", "tests/studio/test_page_server.py -k own_pages"),
    Defect("server/web/http.py", "    page = next((page for page in found if page.name == name), None)\n    if page is None:", "    page = folders[0] / name\n    if not page.is_file():", f"{HTTP} -k outside_the_pages"),
    Defect("server/web/http.py", "    page = next((page for page in found if page.name == name), None)\n    if page is None:", "    page = folders[0] / name\n    if not page.is_file():", "tests/server/test_server.py -k strict_policy"),
    # tokens, hosts, origins
    Defect("server/access.py", 'if self.token == "":', "if False:", f"{BUDGETS} -k token"),
    Defect("server/access.py", "if len(self.token) < MIN_TOKEN:", "if False:", f"{BUDGETS} -k token"),
    Defect("server/web/http.py", "return host in self.names or is_address(host)", "return True", f"{HTTP} -k host_header"),
    Defect("server/edge/request.py", "(not is_opened or is_framed)", "not is_opened", f"{HTTP} -k another_site"),
    Defect("server/edge/request.py", '("cross-site", "same-site")', '("cross-site",)', f"{HTTP} -k another_site"),
    # the request
    Defect("server/edge/request.py", "if _BARE_LINE_END.search(self._data, begins_at, size):", "if False:", f"{REQUEST} -k in_words"),
    Defect("server/edge/request.py", "        if size > self._max_bytes:", "        if False:", f"{REQUEST} -k in_words"),
    Defect("server/edge/request.py", "if len(self._data) > MAX_LINE_BYTES and", "if False and", f"{REQUEST} -k in_words"),
    Defect("server/edge/request.py", "if not _TOKEN.match(self._data):", "if False:", f"{REQUEST} -k in_words"),
    Defect("server/edge/request.py", "    if method not in METHODS:", "    if False:", f"{REQUEST} -k in_words"),
    Defect("server/edge/request.py", '"Transfer-Encoding" in headers or ', "", f"{REQUEST} -k in_words"),
    Defect("server/edge/request.py", "    if len(values) > 1:", "    if False:", f"{REQUEST} -k in_words"),
    Defect("server/edge/request.py", "host if named_host is None else named_host", "host", f"{REQUEST} -k names_a_host"),
    Defect("server/edge/request.py", '"websocket" in _words(headers, "Upgrade")', "True", f"{REQUEST} -k both_headers"),
    Defect("server/edge/request.py", "begins_at = max(0, len(self._data) - len(_END))", "begins_at = len(self._data)", f"{REQUEST} -k it_is_cut"),
    Defect("server/edge/socket.py", "        if not is_head:", "        if True:", f"{REQUEST} -k head_of_the_same"),
    Defect("server/web/scene_files.py", "except (OSError, RuntimeError):", "except OSError:", f"{SCENES} -k nothing_else"),
    # phases
    Defect("server/edge/socket.py", "            self._receive(data, time.monotonic())", "            self.protocol.receive_data(data)", f"{PHASES} -k leave_every_later_read_short"),
    Defect("server/edge/socket.py", "            self._hold_up()\n            self._listener.on_request", "            self._listener.on_request", f"{PHASES} -k nothing_is_read"),
    Defect("server/edge/socket.py", "if self._hello_bytes > most:", "if False:", f"{PHASES} -k each_budget"),
    Defect("server/edge/socket.py", "            if most is None:", "            if True:", f"{PHASES} -k is_admitted"),
    Defect("server/edge/limits.py", "self._frames > most", "False", f"{PHASES} -k each_budget"),
    Defect("server/edge/socket.py", "        self._expire(self._limits.seconds)\n        self._listener.limiter.add", "        self._listener.limiter.add", f"{PHASES} -k says_nothing"),
    Defect("server/edge/socket.py", "        self._update_reading()\n        self._expire(self._limits.seconds)\n", "        self._update_reading()\n", f"{PHASES} -k says_nothing"),
    Defect("server/edge/socket.py", "        self._expire(self._limits.seconds)\n        self.transport.write(piece)", "        self.transport.write(piece)", f"{SCENES} -k slow_network"),
    Defect("server/edge/socket.py", "await self.drain()\n\n    def close", "\n\n    def close", f"{SCENES} -k forty_readers"),
    Defect("server/edge/socket.py", "        self._inbox.clear()\n", "", f"{PHASES} -k is_refused"),
    Defect("server/edge/limits.py", "Phase.CLOSING: PhaseLimits(0, 0,", "Phase.CLOSING: PhaseLimits(0, None,", f"{PHASES} -k is_refused"),
    Defect("server/edge/socket.py", "if self.held > MAX_TEXT_BYTES:", "if False:", f"{PHASES} -k handed_over"),
    Defect("server/edge/limiter.py", "if self._held_bytes > HELD_BYTES:", "if False:", f"{PHASES} -k all_sockets"),
    Defect("server/edge/limiter.py", "max(self._held, key=self._held.__getitem__)", "next(iter(self._held))", f"{PHASES} -k all_sockets"),
    Defect("server/edge/limiter.py", "        self._held_bytes -= self._held.pop(socket, 0)\n", "", f"{PHASES} -k reset"),
    Defect("server/edge/listener.py", "        if is_loopback(socket.remote_address[0]):", "        if True:", f"{PHASES} -k spared"),
    Defect("server/edge/listener.py", "        if len(self._connecting) > MAX_WAITING_SOCKETS:", "        if False:", f"{PHASES} -k no_keys"),
    Defect("server/websocket.py", "        asyncio.get_running_loop().call_later(STOP_S, self._expire, handler)\n", "", f"{PHASES} -k no_slot"),
    # stop and leases
    Defect("devices/plate/requests.py", "if isinstance(message, Rest) and isinstance(self._message, Off):", "if False:", f"{PLATE} -k does_not_undo"),
    Defect("devices/plate/session.py", "elif now - self._unfollowed_since > TRACKING_TIMEOUT_S:", "elif False:", f"{PLATE} -k follows_no"),
    Defect("devices/plate/session.py", "            self._dose.restart()\n", "            pass\n", f"{PLATE} -k survives_its_reset"),
    Defect("devices/speaker/engine.py", "if self._rested < state.rested:", "if False:", f"{AUDIO} -k rest_that_was_lost"),
    Defect("devices/speaker/engine.py", "mixer.gain = state.gain", "pass", f"{AUDIO} -k outlive"),
    Defect("session/hands.py", "self.lease_until = now + LEASE_S", "self.lease_until = now + 1e9", f"{SESSION} -k lease"),
    Defect("devices/plate/peltier.py", "            request_priority(PRIORITY)\n", "            pass\n", "tests/devices/test_peltier.py -k real_time"),
    Defect("server/ownership.py", "owner=True, thermal_gain=self._outputs.thermal_gain)", "owner=True)", f"{GATEWAY} -k thermal_gain"),
    Defect("vision/pictures.py", "    _require_few_chunks(path, data)\n", "", "tests/vision/test_pictures.py -k chunks"),
    # what random clients find
    Defect("session/hands.py", "self.lease_until = now + LEASE_S", "self.lease_until = now + 1e9", f"{RANDOM} -k must_hold"),
    Defect("server/ownership.py", "            requester.session.set_owner(owner=False)\n", "", f"{RANDOM} -k must_hold"),
    Defect("session/hands.py", "return bool(self._held) and self.outputs(hand) == OUTPUTS", "return False", f"{RANDOM} -k must_hold"),
    # reports of dependencies
    Defect("__init__.py", "os.environ.update(_NO_REPORTS)", "pass", "tests/service/test_nothing_leaves.py -k listed"),
    # children
    Defect("backoff.py", "first_s * 2.0 ** min(failures - 1, _MAX_DOUBLINGS)", "first_s", f"{CHILD} -k growing_pause"),
)  # fmt: skip


def is_caught(defect: Defect, scratch: Path) -> bool:
    """Plant one defect in a copy; return whether the test named goes red."""
    package = scratch / "hapticvlm"
    file = package / defect.file
    sound = file.read_text(encoding="utf-8")
    if defect.sound not in sound:
        raise SystemExit(f"{defect.file}: {defect.sound!r} is not there any more")
    file.write_text(sound.replace(defect.sound, defect.planted, 1), encoding="utf-8")
    path = os.pathsep.join([str(scratch), str(ROOT / "service")])
    name, _, chosen = defect.test.partition(" -k ")
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider"]
    try:
        done = subprocess.run(
            [*command, name, "-k", chosen],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            text=True,
            timeout=300.0,
            check=False,
        )
    finally:
        file.write_text(sound, encoding="utf-8")
    if done.returncode not in (0, 1):  # no test was found, or pytest itself failed
        raise SystemExit(f"{defect.test}:\n{done.stdout}{done.stderr}")
    went_red = done.returncode == 1 and "failed" in done.stdout
    if not went_red:
        print(done.stdout, done.stderr)  # a test that passes, or one that could not begin
    return went_red


def main() -> int:
    """Plant those named by number, or all; return how many were not caught."""
    chosen = [int(number) for number in sys.argv[1:]] or range(len(DEFECTS))
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        shutil.copytree(ROOT / "service/hapticvlm", scratch / "hapticvlm")
        for number in chosen:
            defect = DEFECTS[number]
            caught = is_caught(defect, scratch)
            missed += not caught
            verdict = "caught" if caught else "MISSED"
            print(
                f"{number:2} {verdict} {defect.file}: {defect.sound.strip()} | {defect.test}",
                flush=True,
            )
    print(f"{len(chosen) - missed} of {len(chosen)} caught")
    return missed


if __name__ == "__main__":
    sys.exit(main())
