"""`hapticvlm measure invariants`: random clients, kills and freezes, and what must hold after each.

Strangers come, ask what is legal and what is not, and leave without a word; the audio engine and
the recogniser are killed and frozen. Every second one of the checks is made, while all others keep
on asking except where the check itself needs that nobody else touches:

- every request has exactly one answer, within ten seconds;
- no two connections think that they own the outputs, the status names whoever does, and who does
  not is refused;
- a lease that nobody renews ends, and the outputs with it;
- a stop is answered, silence and the end of the plate's current follow, and a touch that goes on
  without having let go is refused and feels nothing;
- no line of the log and no command is lost, and the service prints no traceback.

At the end memory: what the gateway holds alone, as a slope over the run after its first third.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
import signal
import time
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import stats

from hapticvlm import __version__
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.reliability.strangers import Message, Stranger, act, arrive, garbage
from hapticvlm_lab.bench.rigs import service_status

STRANGERS = 5
ACTS_HZ = 150.0
CHECK_S = 1.0
DISTURB_S = 12.0  # between two kills or freezes
FROZEN_S = 0.6
LEAVES = 0.004  # of all acts
GARBAGE = 0.03
SILENT = 1e-4  # of full scale
ENDED_S = 1.0  # from a lapse or a stop until all is at rest; the marks of their own are shorter
BACK_S = 5.0  # a killed engine is there again
KEPT = 12  # last acts told beside a violation
LEAST = 12  # samples of memory for a slope
CHILDREN = ("speaker", "recogniser")


@dataclass(slots=True)
class World:
    """All strangers of one service, what they did, and what did not hold."""

    service: Service
    rng: random.Random
    strangers: dict[Stranger, asyncio.Task[None]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    last: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT))
    violations: list[dict[str, Any]] = field(default_factory=list)
    memory_mb: list[tuple[float, float]] = field(default_factory=list)
    arrived: int = 0
    disturbed_at: float = -1e9

    def found(self, what: str) -> None:
        """Note a violation with what was done before it."""
        self.violations.append({"what": what, "after": list(self.last)})

    async def fill(self) -> None:
        """Let strangers come until all places of this run are taken."""
        while len(self.strangers) < STRANGERS:
            self.arrived += 1
            stranger, reading = await arrive(self.service.url, self.arrived, self.rng)
            self.strangers[stranger] = reading

    async def drop(self, stranger: Stranger) -> None:
        """Let one leave: by a clean close, or as a program that died."""
        self.faults_of(stranger)
        reading = self.strangers.pop(stranger)
        if self.rng.random() < 0.5:
            stranger.socket.transport.abort()
        with contextlib.suppress(OSError, TimeoutError):
            await asyncio.wait_for(stranger.socket.close(), 2.0)
        reading.cancel()

    def faults_of(self, stranger: Stranger) -> None:
        """Take over what a stranger found wrong with its answers."""
        for fault in stranger.faults + stranger.overdue(time.monotonic()):
            self.found(fault)
        self.counts["answers"] += stranger.answered
        stranger.faults, stranger.answered = [], 0

    async def step(self) -> None:
        """Let one of them do one thing."""
        await self.fill()
        stranger = self.rng.choice(list(self.strangers))
        if not stranger.is_open or self.rng.random() < LEAVES:
            self.counts["left"] += 1
            self.last.append(f"{stranger.name} leaves")
            await self.drop(stranger)
        elif self.rng.random() < GARBAGE:
            self.counts["garbage"] += 1
            await stranger.send(garbage(self.rng))
        else:
            message = act(self.rng)
            self.counts["requests"] += 1
            self.last.append(f"{stranger.name}: {message.get('type')} {message.get('phase', '')}")
            await stranger.ask(**message)


def run(*, minutes: float, seed: int, as_json: bool) -> int:
    """Run it, print the figures, and return 1 where something did not hold."""
    with running() as service:
        world = World(service, random.Random(seed))
        asyncio.run(_run(world, minutes * 60.0))
        told = [line for line in service.printed if "Traceback" in line]
    world.violations += [{"what": f"the service printed: {line.strip()}"} for line in told]
    result = {
        "measure": "invariants",
        "hapticvlm": __version__,
        "minutes": minutes,
        "seed": seed,
        "load": round(os.getloadavg()[0], 1),
        "counts": dict(world.counts),
        "memory": _growth(world.memory_mb),
        "violations": world.violations,
    }
    if as_json:
        print(json.dumps(result))
    else:
        for name, value in result.items():
            print(f"{name:<12} {value}")
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
                await asyncio.sleep(1.0 / ACTS_HZ)
            check = checks[number % len(checks)]
            number += 1
            world.counts[f"checked {check.__name__.strip('_')}"] += 1
            await check(world)
            _sample(world)
            for stranger in world.strangers:
                world.faults_of(stranger)
    finally:
        disturbing.cancel()
        await asyncio.gather(disturbing, return_exceptions=True)
        await _settled(world)
        for stranger in list(world.strangers):
            await world.drop(stranger)


async def _disturb(world: World, ends_at: float) -> None:
    """Kill or freeze one of the children now and then; a frozen one goes on by itself."""
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
        world.disturbed_at = time.monotonic()


async def _status(world: World) -> dict[str, Any]:
    return await asyncio.to_thread(service_status, world.service)


async def _settled(world: World) -> None:
    """Wait until all that was asked is answered, or overdue."""
    for _ in range(600):
        if not any(each.asked and each.is_open for each in world.strangers):
            return
        await asyncio.sleep(0.02)


async def _owns(world: World) -> None:
    """Pass the outputs on, and compare who thinks that it owns them with what the service says."""
    scenes = [each for each in world.strangers if each.role == "scene" and each.is_open]
    for giver in [each for each in scenes if each.is_owner]:
        await giver.answer(type="set", ownership="give")
        for taker in [each for each in scenes if each is not giver][:1]:
            await taker.answer(type="set", ownership="take")
    await _settled(world)
    believed = [each.name for each in world.strangers if each.is_owner and each.is_open]
    for what in contradictions(believed, (await _status(world))["owner"]):
        world.found(what)
    for other in [each for each in world.strangers if each.role == "scene" and not each.is_owner]:
        answer = await _touches(other, "contact")
        if answer is not None and answer["type"] == "ok" and not other.is_owner:
            world.found(f"{other.name} owns nothing, and its touch was answered ok")


def contradictions(believed: Sequence[str], owner: str | None) -> list[str]:
    """Return what does not fit of who believes to own the outputs, and whom the status names."""
    found = []
    if len(believed) > 1:
        found.append(f"{' and '.join(believed)} own the outputs at once")
    if believed and (owner is None or believed[0] not in owner):
        found.append(f"{believed[0]} thinks that it owns the outputs; the status says {owner}")
    return found


async def _owner(world: World) -> Stranger | None:
    """Let one scene have the outputs and let go of everything; None where there is no scene."""
    await world.fill()
    scenes = [each for each in world.strangers if each.role == "scene" and each.is_open]
    for scene in scenes:
        await scene.answer(type="set", ownership="take")
        if scene.is_owner:
            thing = {"object_id": "table", "material": "wood", "temperature_c": 5.0}
            await scene.answer(type="scene", objects=[thing], replace=True)
            await scene.answer(type="set", vibration_gain=1.0, thermal_gain=1.0)
            for hand in ("left", "right"):
                await _touches(scene, "release", hand)
            return scene
    return None


async def _touches(scene: Stranger, phase: str, hand: str = "right") -> Message | None:
    motion = {"speed_mps": 0.5, "force_n": 3.0, "captured_at": time.monotonic()}
    return await scene.answer(type="touch", phase=phase, object_id="table", hand=hand, **motion)


async def _goes_on(world: World, within_s: float) -> str | None:
    """Say what has not ended within so long: leases, or vibration; None: all is at rest.

    An engine that was just killed or frozen tells its level late: it has until it is back.
    """
    disturbed_s = time.monotonic() - world.disturbed_at
    gives_up_at = time.monotonic() + within_s + max(0.0, BACK_S - disturbed_s)
    while True:
        found = await _status(world)
        leases, level = found["leases"], found["speaker"]["level"]
        if not leases and level <= SILENT:
            return None
        if time.monotonic() > gives_up_at:
            return f"{leases} leases, level {level:.3g}, {disturbed_s:.1f} s after a disturbance"
        await asyncio.sleep(0.02)


async def _stops(world: World) -> None:
    """Stop while something is felt; then a hand that goes on must feel nothing."""
    scene = await _owner(world)
    if scene is None:
        return
    await _touches(scene, "contact")
    answer = await scene.answer(type="stop", scope="all")
    if answer is not None and answer["type"] != "ok":
        world.found(f"a stop was answered by {answer}")
    if scene.is_open and (what := await _goes_on(world, ENDED_S)):
        world.found(f"after a stop something went on: {what}")
    for _ in range(5):
        refused = await _touches(scene, "slide")
        if refused is not None and refused["type"] == "ok":
            world.found("a hand that did not let go after a stop was answered ok")
    if scene.is_open and (what := await _goes_on(world, 0.0)):
        world.found(f"a hand that did not let go after a stop felt something: {what}")
    await _touches(scene, "release")


async def _lapses(world: World) -> None:
    """Touch, and renew nothing: all must end."""
    scene = await _owner(world)
    if scene is None:
        return
    await _touches(scene, "contact")
    await asyncio.sleep(0.3)
    if what := await _goes_on(world, ENDED_S):
        world.found(f"a lease that nobody renewed went on: {what}")


async def _loses(world: World) -> None:
    """Look for what was lost."""
    found = await _status(world)
    lost = {"log lines lost": found["counts"].get("log lines lost", 0)}
    lost["commands lost"] = found["speaker"]["lost_commands"]
    for what, count in lost.items():
        if count > world.counts[what]:
            world.found(f"{count - world.counts[what]} {what}")
        world.counts[what] = count


def _sample(world: World) -> None:
    import psutil

    with contextlib.suppress(psutil.Error):
        held = psutil.Process(world.service.process.pid).memory_full_info().uss / 2**20
        world.memory_mb.append((time.monotonic(), held))


def _growth(held: list[tuple[float, float]]) -> dict[str, Any] | None:
    """Return the slope after the first third, MB/h with 95 % (Theil-Sen); None: too short."""
    warm = held[len(held) // 3 :]
    if len(warm) < LEAST:
        return None
    times, sizes = np.array(warm).T
    slope, _, low, high = stats.theilslopes(sizes, times / 3600.0)
    found = [round(float(each), 1) for each in (slope, low, high)]
    return {"warm_mb": round(float(sizes[0]), 1), "slope_mb_per_h": found}
