"""`hapticvlm measure invariants`: what must hold beside random clients, kills and freezes.

Random clients connect, send what is legal and what is not, and leave without a word, while the
audio engine and the recogniser are killed and frozen. Once a second one of the checks runs. All
other clients go on meanwhile, except where the check itself needs that nobody else touches:

- every request has exactly one answer, within ten seconds;
- no two connections believe that they own the outputs, the status names the one that does, and a
  connection that does not own them is refused;
- a lease that nobody renews ends, and the outputs with it;
- a stop is answered, silence and the end of the plate's current follow, and a touch that goes on
  without a release is refused and renders nothing;
- no line of the log and no command is lost, and the service prints no traceback;
- a killed child is back within a quarter of a minute.

A seed repeats the requests in their order, though not their timing.

Memory is what a process holds alone (unique set size): shared pages count for no process, so a leak
in one of them is not blamed on the others. Its growth is Theil and Sen's slope, the median over the
slopes of all pairs of samples: a single garbage collection or a burst of clients moves a
least-squares line, but not a median. The first third of the life of a process is left out, since
caches fill then.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
import signal
import time
from collections import Counter, defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rich.console import Console
from scipy import stats

from hapticvlm import __version__
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.reliability.random_clients import (
    Message,
    RandomClient,
    connect,
    garbage,
    random_request,
)
from hapticvlm_lab.bench.rigs import service_status

CLIENTS = 5
REQUESTS_HZ = 150.0
CHECK_S = 1.0
DISTURB_S = 12.0  # between two kills or freezes
FROZEN_S = 0.6
LEAVES = 0.004  # of all requests
GARBAGE = 0.03
SILENT = 1e-4  # of full scale
ENDED_S = 1.0  # from a lapse or a stop until all is at rest; each has a shorter mark of its own
BACK_S = 5.0  # from the death of the engine until its level counts again
BACK_WITHIN_S = 15.0  # from the death of any child until another one works
KEPT = 12  # last requests that are reported with a violation
LEAST = 12  # samples of memory for a slope
CHILDREN = ("speaker", "recogniser")

Samples = list[tuple[float, float]]  # (monotonic s, figure)


@dataclass(slots=True)
class World:
    """All random clients of one service, what they did, and what did not hold."""

    service: Service
    rng: random.Random
    clients: dict[RandomClient, asyncio.Task[None]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    last: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT))
    violations: list[dict[str, Any]] = field(default_factory=list)
    memory_mb: defaultdict[str, Samples] = field(default_factory=lambda: defaultdict(list))
    files: list[int] = field(default_factory=list)
    connected: int = 0
    disturbed_at: float = -1e9

    def violated(self, what: str) -> None:
        """Note a violation with the requests before it."""
        self.violations.append({"what": what, "after": list(self.last)})

    async def fill(self) -> None:
        """Connect clients until all places of this run are taken."""
        while len(self.clients) < CLIENTS:
            self.connected += 1
            client, reading = await connect(self.service.url, self.connected, self.rng)
            self.clients[client] = reading

    async def drop(self, client: RandomClient) -> None:
        """Let a client leave: by a clean close, or like a program that died."""
        self.collect_faults(client)
        reading = self.clients.pop(client)
        if self.rng.random() < 0.5:
            client.socket.transport.abort()
        with contextlib.suppress(OSError, TimeoutError):
            await asyncio.wait_for(client.socket.close(), 2.0)
        reading.cancel()

    def collect_faults(self, client: RandomClient) -> None:
        """Take over the faults that a client found in its answers."""
        for fault in client.faults + client.overdue(time.monotonic()):
            self.violated(fault)
        self.counts["answers"] += client.answered
        client.faults = []
        client.answered = 0

    async def step(self) -> None:
        """Let one of the clients do one thing."""
        await self.fill()
        client = self.rng.choice(list(self.clients))
        if not client.is_open or self.rng.random() < LEAVES:
            self.counts["left"] += 1
            self.last.append(f"{client.name} leaves")
            await self.drop(client)
        elif self.rng.random() < GARBAGE:
            self.counts["garbage"] += 1
            await client.send(garbage(self.rng))
        else:
            message = random_request(self.rng)
            self.counts["requests"] += 1
            self.last.append(f"{client.name}: {message.get('type')} {message.get('phase', '')}")
            await client.ask(**message)

    def sample(self, status: dict[str, Any]) -> None:
        """Note the memory of each process, and descriptors of the gateway."""
        import psutil

        now = time.monotonic()
        gateway = psutil.Process(self.service.process.pid)
        pids = {"gateway": gateway.pid}
        pids |= {f"{part} {pid}": pid for part in CHILDREN if (pid := status[part]["pid"])}
        for name, pid in pids.items():
            with contextlib.suppress(psutil.Error):  # a child that was just killed
                held = psutil.Process(pid).memory_full_info().uss / 2**20
                self.memory_mb[name].append((now, held))
        with contextlib.suppress(psutil.Error):
            self.files.append(gateway.num_fds())


def run(*, minutes: float, seed: int, as_json: bool) -> int:
    """Run it and print the figures; return 1 where something did not hold."""
    console = Console(quiet=as_json, width=120)
    with running() as service:
        world = World(service, random.Random(seed))
        with console.status(f"{minutes:g} minutes of random clients"):
            asyncio.run(_run(world, minutes * 60.0))
        tracebacks = [line for line in service.printed if "Traceback" in line]
    world.violations += [{"what": f"the service printed: {line.strip()}"} for line in tracebacks]
    result = {
        "measure": "invariants",
        "hapticvlm": __version__,
        "minutes": minutes,
        "seed": seed,
        "load": round(os.getloadavg()[0], 1),
        "counts": dict(world.counts),
        "memory": {
            name: growth for name, held in world.memory_mb.items() if (growth := _growth(held))
        },
        "descriptors": _first_last_most(world.files),
        "violations": world.violations,
    }
    if as_json:
        print(json.dumps(result))
    else:
        for name, value in result.items():
            console.print(f"{name:<12} {value}", highlight=False)
    return int(bool(world.violations))


async def _run(world: World, seconds: float) -> None:
    ends_at = time.monotonic() + seconds
    disturbing = asyncio.create_task(_disturb(world, ends_at))
    checks = (_owns, _stops, _lapses, _loses)
    number = 0
    try:
        while time.monotonic() < ends_at:
            until = time.monotonic() + CHECK_S
            while time.monotonic() < until:
                await world.step()
                await asyncio.sleep(1.0 / REQUESTS_HZ)
            check = checks[number % len(checks)]
            number += 1
            world.counts[f"checked {check.__name__.strip('_')}"] += 1
            await check(world)
            world.sample(await _status(world))
            for client in world.clients:
                world.collect_faults(client)
    finally:
        disturbing.cancel()
        await asyncio.gather(disturbing, return_exceptions=True)
        await _settled(world)
        for client in list(world.clients):
            await world.drop(client)


async def _disturb(world: World, ends_at: float) -> None:
    """Kill or freeze one of the children now and then; a frozen one is continued."""
    rng = random.Random(world.rng.random())
    while time.monotonic() + 2 * DISTURB_S < ends_at:
        await asyncio.sleep(DISTURB_S)
        part = rng.choice(CHILDREN)
        pid = (await _status(world))[part]["pid"]
        if not pid:
            continue
        is_kill = rng.random() < 0.5
        world.counts["kills" if is_kill else "freezes"] += 1
        world.last.append(f"{part} {'killed' if is_kill else 'frozen'}")
        world.disturbed_at = time.monotonic()
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL if is_kill else signal.SIGSTOP)
            if not is_kill:
                await asyncio.sleep(FROZEN_S)
                os.kill(pid, signal.SIGCONT)
        # Noted again after a freeze: the engine reports nothing while it is frozen, and its last
        # level counts as old until it has had its time to come back.
        world.disturbed_at = time.monotonic()
        if is_kill:
            await _returns(world, part, pid)


async def _returns(world: World, part: str, dead: int) -> None:
    """Wait until another child works in place of the dead one."""
    killed_at = time.monotonic()
    while time.monotonic() - killed_at < BACK_WITHIN_S:
        child = (await _status(world))[part]
        works = child["plays"] if part == "speaker" else child["ready"]
        if works and child["pid"] not in (None, dead):
            return
        await asyncio.sleep(0.02)
    world.violated(f"{part} was not back {BACK_WITHIN_S:g} s after its death")


async def _status(world: World) -> dict[str, Any]:
    return await asyncio.to_thread(service_status, world.service)


async def _settled(world: World) -> None:
    """Wait until every request is answered or overdue."""
    for _ in range(600):
        if not any(each.asked and each.is_open for each in world.clients):
            return
        await asyncio.sleep(0.02)


async def _owns(world: World) -> None:
    """Pass the outputs on, and compare the clients that believe to own them with the status."""
    # Ownership is passed on first, so that the check meets the moment at which two could own.
    # Events are then awaited: a client that has not heard yet that it lost the outputs is not at
    # fault.
    scenes = [each for each in world.clients if each.role == "scene" and each.is_open]
    for giver in [each for each in scenes if each.is_owner]:
        await giver.answer(type="set", ownership="give")
        for taker in [each for each in scenes if each is not giver][:1]:
            await taker.answer(type="set", ownership="take")
    await _settled(world)
    believed = [each.name for each in world.clients if each.is_owner and each.is_open]
    for what in contradictions(believed, (await _status(world))["owner"]):
        world.violated(what)
    for other in [each for each in world.clients if each.role == "scene" and not each.is_owner]:
        answer = await _touch(other, "contact")
        if answer is not None and answer["type"] == "ok" and not other.is_owner:
            world.violated(f"{other.name} does not own the outputs, but its touch was answered ok")


def contradictions(believed: Sequence[str], owner: str | None) -> list[str]:
    """Compare the clients that believe to own the outputs with the owner that the status names."""
    contradicting = []
    if len(believed) > 1:
        contradicting.append(f"{' and '.join(believed)} own the outputs at once")
    if believed and (owner is None or believed[0] not in owner):
        contradicting.append(f"{believed[0]} believes to own the outputs; the status says {owner}")
    return contradicting


async def _owner(world: World) -> RandomClient | None:
    """Give one scene the outputs and release every hand; None where there is no scene."""
    await world.fill()
    scenes = [each for each in world.clients if each.role == "scene" and each.is_open]
    for scene in scenes:
        await scene.answer(type="set", ownership="take")
        if scene.is_owner:
            thing = {"object_id": "table", "material": "wood", "temperature_c": 5.0}
            await scene.answer(type="scene", objects=[thing], replace=True)
            await scene.answer(type="set", vibration_gain=1.0, thermal_gain=1.0)
            for hand in ("left", "right"):
                await _touch(scene, "release", hand)
            return scene
    return None


async def _touch(scene: RandomClient, phase: str, hand: str = "right") -> Message | None:
    motion = {"speed_mps": 0.5, "force_n": 3.0, "captured_at": time.monotonic()}
    return await scene.answer(type="touch", phase=phase, object_id="table", hand=hand, **motion)


async def _still_active(world: World, within_s: float) -> str | None:
    """Describe what has not ended within so long, leases or vibration; None: all is at rest.

    An engine that was just killed or frozen reports its level late: it has until it is back.
    """
    disturbed_s = time.monotonic() - world.disturbed_at
    gives_up_at = time.monotonic() + within_s + max(0.0, BACK_S - disturbed_s)
    while True:
        status = await _status(world)
        leases = status["leases"]
        level = status["speaker"]["level"]
        if not leases and level <= SILENT:
            return None
        if time.monotonic() > gives_up_at:
            return f"{leases} leases, level {level:.3g}, {disturbed_s:.1f} s after a disturbance"
        await asyncio.sleep(0.02)


async def _stops(world: World) -> None:
    """Stop during a touch; then a hand that goes on must feel nothing."""
    scene = await _owner(world)
    if scene is None:
        return
    await _touch(scene, "contact")
    answer = await scene.answer(type="stop", scope="all")
    if answer is not None and answer["type"] != "ok":
        world.violated(f"a stop was answered by {answer}")
    if scene.is_open and (active := await _still_active(world, ENDED_S)):
        world.violated(f"after a stop something went on: {active}")
    for _ in range(5):
        refused = await _touch(scene, "slide")
        if refused is not None and refused["type"] == "ok":
            world.violated("a slide after a stop, without a release, was answered ok")
    if scene.is_open and (active := await _still_active(world, 0.0)):
        world.violated(f"a slide after a stop, without a release, was rendered: {active}")
    await _touch(scene, "release")


async def _lapses(world: World) -> None:
    """Touch, and renew nothing: all must end."""
    scene = await _owner(world)
    if scene is None:
        return
    await _touch(scene, "contact")
    await asyncio.sleep(0.3)
    if active := await _still_active(world, ENDED_S):
        world.violated(f"a lease that nobody renewed went on: {active}")


async def _loses(world: World) -> None:
    """Look for lost lines of the log and lost commands."""
    status = await _status(world)
    lost = {"log lines lost": status["counts"].get("log lines lost", 0)}
    lost["commands lost"] = status["speaker"]["lost_commands"]
    for what, count in lost.items():
        if count > world.counts[what]:
            world.violated(f"{count - world.counts[what]} {what}")
        world.counts[what] = count


def _growth(held: Samples) -> dict[str, Any] | None:
    """Return the memory of a process after its first third, MB, and the slope, MB/h with 95 %.

    None for a process that did not live long enough.
    """
    # The interval of the slope is from Kendall's test: it asks how many pairs of samples rise, and
    # so does not assume that the noise of memory is normal, which it is not.
    warm = held[len(held) // 3 :]
    if len(warm) < LEAST:
        return None
    times, sizes = np.array(warm).T
    slope, _, low, high = stats.theilslopes(sizes, times / 3600.0)
    return {
        "first_mb": round(held[0][1], 1),
        "warm_mb": round(float(sizes[0]), 1),
        "last_mb": round(float(sizes[-1]), 1),
        "slope_mb_per_h": [round(float(each), 1) for each in (slope, low, high)],
    }


def _first_last_most(counts: list[int]) -> list[int]:
    return [counts[0], counts[-1], max(counts)] if counts else []
