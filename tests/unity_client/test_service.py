"""The package's connection on Mono against the real service: touches, frames, kills."""

import asyncio
import json
import os
import re
import socket
import statistics
import subprocess
from pathlib import Path

from pace import PACE
from ports import free_port
from scene_cases import of_clients

from hapticvlm.client import connect
from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
ANSWERS = Path(__file__).parents[2] / "schemas" / "vectors" / "answers.json"
TOUCHES = 250
FIELDS = ("object_id", "name", "material", "temperature_c")
# What the types of C# do not let anybody state, or a dictionary of objects does not hold twice.
UNTYPED = {
    "a name that is not text",
    "an object without an id",
    "an id that is there twice",
    "an id that is too long",  # is cut, as the ids of its touches are
}
KILLS = int(os.environ.get("HAPTICVLM_KILLS", "1"))  # 10 before a release
MAIN_LOOP_MS = 2.0
SOAK_S = 1200.0


def figures(line):
    return {key: float(value) for key, value in re.findall(r"(\w+) (-?[\d.]+(?:E-?\d+)?)", line)}


def is_our_fault(output):
    """Return the first error that is not an audio underrun of a busy machine."""
    line = next(line for line in output.splitlines() if line.startswith("errors "))
    errors = line.removeprefix("errors ").split("|")
    return next((error for error in errors if error and not error.startswith("Device:")), None)


async def python_round_trips(url, count):
    """Return round-trip times of sequential touches from the Python client, ms."""
    trips = []
    async with connect(url) as client:
        await client.scene([{"object_id": "table", "name": "Oak_Table_02"}], ambient_c=21.0)
        for i in range(count):
            began = asyncio.get_running_loop().time()
            await client.touch("release" if i % 2 else "contact", "table")
            trips.append(1000.0 * (asyncio.get_running_loop().time() - began))
            await asyncio.sleep(0.001)
    return trips


def test_a_touch_from_unity_takes_about_as_long_as_one_from_python(build, service, capsys):
    unity, python = [], []
    for _ in range(2):
        output = build.run("programs.exe", "round-trips", service.url, str(TOUCHES))
        assert "material wood" in output
        assert "threads left 0" in output
        unity += [float(line[3:]) for line in output.splitlines() if line.startswith("ms ")]
        python += asyncio.run(python_round_trips(service.url, TOUCHES))
    assert len(unity) == 2 * TOUCHES
    medians = statistics.median(unity), statistics.median(python)
    with capsys.disabled():
        print(
            f"\ntouch round trip, median of {len(unity)}: C# on Mono {medians[0]:.2f} ms, "
            f"Python {medians[1]:.2f} ms, ratio {medians[0] / medians[1]:.2f}"
        )
    assert medians[0] < 10.0 * medians[1]


def lines_of(cases):
    """Return the lines that describe cases to the program; Unity's fields have types."""
    for case in cases:
        for each in case["objects"]:
            fields = (each.get(name, "") for name in FIELDS)
            yield "\t".join(["put", *map(str, fields)])
        yield from (f"touch\t{key}" for key in case["touch"])
        yield "end"


def test_of_every_scene_the_good_part_is_felt_and_the_rest_is_named(build, service):
    cases = [
        case
        for case in of_clients()
        if case["name"] not in UNTYPED and all(set(each) <= {*FIELDS} for each in case["objects"])
    ]
    assert len(cases) >= 6
    text = "\n".join(lines_of(cases)) + "\n"
    output = build.run("programs.exe", "scene-cases", service.url, text=text, timeout=SOAK_S)
    assert is_our_fault(output) is None
    *heard, _ = output.split("\nend\n")
    assert len(heard) == len(cases)
    for case, said in zip(cases, heard, strict=True):
        part = said.replace("left_out captured_at", "")  # of a touch on a slow machine
        felt = dict(re.findall(r"felt (\S+) (\w+)", part))
        assert felt == case["felt"], case["name"]
        states_unknown = case["name"] in ("an unknown material", "a material in capitals")
        if not states_unknown:  # which the inspector and the console name, before anything is sent
            assert ("left_out" in part) == case["tells"], case["name"]


def test_kills_lose_no_touch_and_the_scene_is_registered_again(build, capsys):
    port = free_port()
    command = ["mono", "--debug", str(build.folder / "programs.exe"), "restarts"]
    with subprocess.Popen(
        [*command, f"ws://127.0.0.1:{port}/", str(KILLS + 1)], stdout=subprocess.PIPE, text=True
    ) as scene:
        assert scene.stdout is not None
        for number in range(1, KILLS + 2):
            with running(["--port", str(port)]) as service:
                line = scene.stdout.readline()
                if number <= KILLS:
                    service.process.kill()
                else:
                    rest = scene.stdout.read()
            assert line.startswith(f"round {number} accepted 90 sent 90 answered 90 ")
            assert "table wood kettle metal" in line
        assert scene.wait(60 * PACE) == 0
    longest = figures(rest)["longest_cpu_ms"]
    with capsys.disabled():
        print(f"\nlongest turn of the main loop over {KILLS} kills: {longest:.2f} ms of thread CPU")
    assert is_our_fault(rest) is None
    assert "threads left 0" in rest
    assert longest < 10.0 * MAIN_LOOP_MS


def test_our_own_code_allocates_nothing_per_frame(build):
    answers = {case["name"]: case["msgpack"] for case in json.loads(ANSWERS.read_text())}
    given = f"{answers['decision']}\n{answers['telemetry']}\n"
    output = figures(build.run("programs.exe", "allocations", "3000", text=given))
    assert output == {"frames": 3000, "decided": 3000, "allocated": 0}


def test_a_mute_peer_holds_nobody_up(build):
    with socket.socket() as mute:
        mute.bind(("127.0.0.1", 0))
        mute.listen()
        output = build.run("programs.exe", "refused", f"ws://127.0.0.1:{mute.getsockname()[1]}/")
    assert "no answer from" in output
    assert "threads left 0" in output
