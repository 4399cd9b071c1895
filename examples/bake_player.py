"""The smallest player of a feel file of `hapticvlm bake`; docs/player.md explains each rule.

    feel = opened(json.load(open("feel.true.json")))
    player = Player(feel, lambda touch: {"material": "wood"})
    player.touch({"phase": "contact", "hand": "right", "speed_mps": 0.4, "force_n": 1.5}, seconds)
    player.plan("right", "parametric", seconds)  # the next 100 ms, for a controller

`Player(feel, surface_of, rate_hz=48000)` renders samples instead, `player.render(480, seconds)`.
It knows no clock: times are arguments, in s.
"""

from __future__ import annotations

import bisect
import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from feel_file import IMPACTS, TEXTURES, Json
from numpy.typing import NDArray

SOON = 1e-9
FORMS = ["amplitude", "parametric"]
Floats = NDArray[np.float64]
State = tuple[float, float]  # value and slope of a smoothed number
# One turn of a sine as a loop: a hum is played as everything else, and its rate is its frequency.
SINE: Json = {
    "gain": None,
    "rate_hz": 32,
    "wave": np.exp(1j * np.arange(32) * (np.pi / 16)),
}


class Piece(NamedTuple):
    """What sounds of one clip in a moment: from `at`, s of the clip, on, at this rate.

    `begin` and `end` are the gain of the samples. A pad plays `drive`, `felt` and `hz`, and the
    compression follows `body`.
    """

    clip: Json
    at: float
    rate: float
    begin: float
    end: float
    drive: float
    felt: float
    hz: float
    body: float


class Player:
    """Plays the touches of both hands. `surface_of(touch)` returns a surface of materials.json."""

    def __init__(
        self,
        feel: Json,
        surface_of: Callable[[Json], Any],
        rate_hz: int | None = None,
        say: Callable[[str], object] = print,
    ) -> None:
        self.feel = feel
        self.surface_of = surface_of
        self.rate_hz = rate_hz
        self.gain = 1.0  # 0 to 1, of everything
        self.said: set[str] = set()  # fields of which a problem was said
        self._say = say
        self._drawn = 1
        self._turned_down = 0.0
        self._turn = 0.0  # of the shift of the sound voice
        self._held = 0.0  # level that the compression of the sound voice follows
        self._compression: float | None = None
        self._hands = {name: _Hand(rate_hz is None) for name in feel["words"]["hand"]}

    def touch(self, touch: Json, now: float) -> bool:
        """Receive a touch at `now`, s; return whether an impact begins, which asks for a plan."""
        if self._clock(now) is None or not self._knows(touch):
            return False
        hand = self._hands[touch["hand"]]
        phase, interaction = touch["phase"], touch.get("interaction")
        if phase == "release":
            hand.is_armed = hand.is_held
            hand.rest()
            return False
        if hand.is_armed and phase in ("approach", "contact"):
            hand.is_held = hand.is_armed = False
        if hand.is_held:
            return False
        if hand.lease_until is not None and now > hand.lease_until:
            hand.rest()
        if self.rate_hz is None:
            self._run(hand, now)
        self._notes_milliseconds(hand, phase, now)
        onset = not hand.touches and phase == "contact"
        hand.lease_until = now + self.feel["rules"]["lease_s"]
        hand.touches = phase != "approach"
        if not hand.touches and interaction != "swing":
            hand.let_go()
            return False
        is_texture = interaction in TEXTURES
        slides = phase == "slide" or is_texture or not (onset or interaction)
        kind = "slide" if slides and not is_texture else interaction or "strike"
        self._feel(hand, touch, kind, onset=onset)
        return onset

    def stop(self) -> None:
        """End everything; a hand is felt again after its release and a new approach or contact."""
        for hand in self._hands.values():
            hand.is_held, hand.is_armed = True, False
            hand.rest()

    def plan(self, name: str, form: str, now: float) -> Json:
        """Return the next moments of a hand as a `vibration` event; empty lists are silence."""
        pad, step_s = self.feel["rules"]["pad"], self.feel["rules"]["step_s"]
        is_form, at = self._is_word("form", form, FORMS), self._clock(now)
        period_s = pad["period_s"][form if is_form else FORMS[0]]
        plan: Json = {"period_ms": 1000 * period_s, "amplitude": []}
        plan |= {"frequency_hz": [], "transients": []}
        hand = self._hands[name] if is_form and self._is_word("hand", name) else None
        if hand is None or at is None or hand.lease_until is None:
            return plan
        if hand.lease_until <= at:
            hand.rest()
            return plan
        begun = [shot for shot in hand.impacts() if shot.is_new]
        for shot in begun:
            shot.is_new = False
        self._run(hand, at)
        ahead, drawn = hand.fork(), self._drawn
        size = round(period_s / step_s)
        steps = round(pad["horizon_s"] / period_s) * size
        powers = np.array([_powers(self._pieces(ahead, step_s)) for _ in range(steps)])
        self._drawn = drawn
        drive, felt, turned = powers.reshape(-1, size, 3).mean(axis=1).T
        level = np.minimum(np.sqrt(felt if form == "amplitude" else drive), 1.0)
        amplitude = self._on_pad(level, form)
        if begun:
            first = amplitude[: int(pad["min_impact_s"] / period_s + SOON)]
            first[:] = np.maximum(first, pad["min_impact"])
        count = max(1, math.floor(min(pad["horizon_s"], hand.lease_until - at) / period_s + SOON))
        amplitude = amplitude[:count] * self._within("gain", self.gain, 1.0)
        if amplitude.max() < pad["min_amplitude"]:
            return plan
        plan["amplitude"] = amplitude.round(4).tolist()
        if form == "parametric":
            hertz = np.sqrt(turned / np.maximum(drive, 1e-12))
            plan["frequency_hz"] = np.clip(hertz, 20, 1000)[:count].round(1).tolist()
            plan["transients"] = [self._transient(shot) for shot in begun]
        return plan

    def render(self, count: int, now: float) -> Floats:
        """Return the next samples of both hands, (count,), -1..1, from the time `now` on."""
        wave, at = np.zeros(count), self._clock(now)
        if at is None or self.rate_hz is None:
            return wave
        piece = max(1, int(self.feel["rules"]["step_s"] * self.rate_hz))
        for begin in range(0, count, piece):
            part = wave[begin : begin + piece]
            for hand in self._hands.values():
                if hand.lease_until is not None and hand.lease_until < at + begin / self.rate_hz:
                    hand.rest()
            dt = part.size / self.rate_hz
            shift = self._shift(part.size)
            pieces = [each for hand in self._hands.values() for each in self._pieces(hand, dt)]
            for one in pieces:
                read = _read(one.clip, one.at, one.rate / self.rate_hz, part.size)
                if np.iscomplexobj(read):
                    read = (read * shift).real
                part += read * np.linspace(one.begin, one.end, part.size)
            part *= self._gains(pieces, part.size, dt)
            self._limit(part, dt)
        return wave

    def _feel(self, hand: _Hand, touch: Json, kind: str, *, onset: bool) -> None:
        """Tell a hand what it feels now."""
        surface = self.surface_of(touch)
        surface = surface if isinstance(surface, dict) else {}
        speed = self._within("speed_mps", touch.get("speed_mps"), 0.0)
        force = self._within("force_n", touch.get("force_n"), 1.5)
        gain = self._within("impact_gain", surface.get("impact_gain"), 1.0)
        gain = gain if kind in IMPACTS else 1.0
        thickness_m = self._within("thickness_m", surface.get("thickness_m"), None)
        hum = self._hum(surface.get("hum")) if hand.touches else None
        hand.fade()
        if hum:
            hand.follow("hum", hum["level"], hum, lambda: [_Hum()])
        name = surface.get("material")
        facts = self.feel["materials"].get(name) if isinstance(name, str) else None
        if facts is None:
            if name not in (None, "unknown"):
                self._note("material", f"{name!r} is not in the feel file; bake it")
            return
        if onset and kind != "swing":
            self._strike(hand, facts, kind if kind in IMPACTS else "tap", (speed, force), gain)
        if kind == "press" and facts["n_per_grain"] is not None:
            hand.follow(f"press {name}", gain, force, lambda: [_Press(facts, self.draw(), gain)])
        if kind in TEXTURES:
            usual_m = facts["thickness_m"]
            thin = usual_m / (thickness_m or usual_m) if kind == "swing" else 1.0
            to = speed, force, speed * thin
            begin = partial(self._texture, hand, facts[kind], facts["grain"], to[2])
            hand.follow((name, kind, thin), 1.0, to, begin)

    def _strike(self, hand: _Hand, facts: Json, kind: str, motion: State, gain: float) -> None:
        ringing = hand.impacts()
        if len(ringing) >= self.feel["rules"]["max_impacts"]:
            return
        loud = [shot for shot in ringing if shot.aim > 0.0]
        if len(loud) >= self.feel["rules"]["max_ringing"]:
            loud[0].aim = 0.0
        table, impact = self.feel["impacts"][kind], facts[kind]
        place = self.look(table["place"], *motion)
        clips = [self.feel["clips"][clip] for clip in impact["clips"]]
        first = min(int(place), len(clips) - 1)
        clip = _blended(clips[first], clips[min(first + 1, len(clips) - 1)], place - first)
        rules, varied = self.feel["rules"], 2.0 * self.draw() - 1.0
        level, rate = 1.0 - rules["level_varies"] * varied, 1.0 + rules["pitch_varies"] * varied
        palm, pad = (
            min(level * impact[on] * self.look(table[on], *motion), clip["most"])
            for on in ("palm", "pad")
        )
        skip_s = self.look(table["skip_s"], *motion)
        hand.voices.append(_Shot(clip, palm, pad, gain, rate, facts["hz"], skip_s, key=kind))

    def _pieces(self, hand: _Hand, dt: float) -> list[Piece]:
        """Let a hand sound for `dt`, s; return what sounds."""
        pieces: list[Piece] = []
        step = dt / self.feel["rules"]["fade_s"]
        for voice in hand.voices:  # grains that begin are added at the end, and sound at once
            before = voice.fade
            voice.fade += min(max(voice.aim - voice.fade, -step), step)
            pieces += voice.advance(self, hand, before, dt)
        hand.voices = [voice for voice in hand.voices if voice.fade or voice.aim]
        return pieces

    def _texture(self, hand: _Hand, facts: Json, grain: str, speed: float) -> list[Any]:
        """Return the voices of a texture: a loop for each layer, and breaks.

        Too many others that fade end at once.
        """
        voices: list[Any] = []
        others = {voice.key for voice in hand.voices if isinstance(voice, _Layer)}
        if len(others) > self.feel["rules"]["max_textures"]:
            hand.voices = [voice for voice in hand.voices if not isinstance(voice, _Layer)]
        for layer in facts["layers"]:
            clip = self.feel["loops"][layer["loop"]]
            at = self.draw() * clip["wave"].size / clip["rate_hz"]
            voices.append(_Layer(clip, layer, at, (speed, 0.0)))
        return (
            [*voices, _Breaks(facts["breaks"], grain, self.draw())] if facts["breaks"] else voices
        )

    def grain(self, name: str, gain: float, late_s: float) -> _Shot:
        """Return a grain that begins `late_s` after the begin of this step."""
        return _Shot(self.feel["clips"][name], gain, gain, 1.0, at=-late_s, key="grain")

    def _shift(self, count: int) -> Any:  # noqa: ANN401
        """Return the factor of complex samples in the next ones, (count,); 1 in the true voice."""
        sound = self.feel["rules"]["sound"]
        if sound is None or self.rate_hz is None:
            return 1.0
        turns = self._turn + np.arange(count) * (sound["shift_hz"] / self.rate_hz)
        self._turn = (self._turn + count * sound["shift_hz"] / self.rate_hz) % 1.0
        return np.exp(2j * np.pi * turns)

    def _gains(self, pieces: list[Piece], count: int, dt: float) -> Floats:
        """Return the compression of the sound voice, (count,); 1 in the true voice."""
        sound, gain = self.feel["rules"]["sound"], self._within("gain", self.gain, 1.0)
        if sound is None:
            return np.full(count, gain)
        body = sum(each.body**2 for each in pieces)
        self._held = max(self._held * math.exp(-sound["fall_per_s"] * dt), math.sqrt(body))
        to = sound["level"] * max(self._held, sound["lowest"]) ** (sound["exponent"] - 1.0)
        before, self._compression = self._compression, to
        return np.asarray(gain * np.linspace(to if before is None else before, to, count))

    def _limit(self, part: Floats, dt: float) -> None:
        """Turn down what would leave the range, at once, and recover slowly."""
        rules = self.feel["rules"]
        needed = 1.0 - rules["ceiling"] / max(float(np.abs(part).max()), rules["ceiling"])
        self._turned_down = max(needed, self._turned_down * math.exp(-dt / rules["recover_s"]))
        part *= 1.0 - self._turned_down

    def _on_pad(self, level: Floats, form: str) -> Floats:
        pad = self.feel["rules"]["pad"]
        scaled = np.minimum(pad["scale"][form] * level ** pad["exponent"], 1.0)
        return np.where(level < pad["min_level"], 0.0, scaled)

    def _transient(self, shot: _Shot) -> Json:
        peak = self._on_pad(
            np.array(min(shot.pad * shot.fade / shot.clip["most"], 1.0)), "parametric"
        )
        amplitude = max(float(peak), self.feel["rules"]["pad"]["min_impact"])
        return {
            "at_ms": 0,
            "amplitude": round(amplitude * self._within("gain", self.gain, 1.0), 4),
            "frequency_hz": shot.hz,
        }

    def _run(self, hand: _Hand, now: float) -> None:
        """Let a hand that is planned sound until `now`."""
        left = 0.0 if hand.time is None else min(max(now - hand.time, 0.0), 0.5)
        hand.time = now
        while left > SOON and hand.voices:
            self._pieces(hand, min(left, self.feel["rules"]["step_s"]))
            left -= self.feel["rules"]["step_s"]

    def look(self, table: Any, speed: float, force: float | None = None) -> float:  # noqa: ANN401
        """Return the value of a table at a speed, and at a force: linear between, held beyond."""
        at, share = _between(self.feel["speeds_mps"], speed)
        low, high = table[at], table[at + 1]
        if force is not None:
            on, part = _between(self.feel["forces_n"], force)
            low, high = (row[on] + part * (row[on + 1] - row[on]) for row in (low, high))
        return float(low + share * (high - low))

    def smooth(self, state: State, target: float, dt: float) -> State:
        """Return value and slope of a number that follows its target through two low-passes."""
        time, distance = dt / self.feel["rules"]["smooth_s"], state[0] - target
        push, decay = state[1] + distance, math.exp(-time)
        return target + (distance + push * time) * decay, (state[1] - push * time) * decay

    def draw(self) -> float:
        """Return the next number of a sequence that looks random, 0..1; every player has it."""
        self._drawn = (75 * self._drawn + 74) % 65537
        return (self._drawn + 0.5) / 65537.0

    def _within(self, name: str, value: Any, missing: Any) -> Any:  # noqa: ANN401
        low, high = self.feel["ranges"][name]
        if value is None:
            return missing
        if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
            self._note(name, f"{value!r} is not a number; {missing} is used; pass a number")
            return missing
        if not low <= value <= high:
            self._note(name, f"{value:g} is outside {low:g} to {high:g}; the nearest is used")
        return float(min(max(value, low), high))

    def _hum(self, hum: Any) -> Json | None:  # noqa: ANN401
        if hum is None:
            return None
        hum = hum if isinstance(hum, dict) else {}
        level, drives = self._within("hum.level", hum.get("level"), 0.0), hum.get("drives")
        hertz = self._within("hum.frequency_hz", hum.get("frequency_hz"), 0.0)
        is_list = isinstance(drives, (list, tuple)) and len(drives) <= 16
        are_drives = is_list and all(isinstance(d, (int, float)) and abs(d) <= 100 for d in drives)
        if not (level and hertz and are_drives):
            self._note("hum", "needs frequency_hz, level and drives, as materials.json has them")
            return None
        return {"level": level, "hz": hertz, "drives": drives}

    def _knows(self, touch: Json) -> bool:
        is_kind = touch.get("interaction") is not None
        names = ("phase", "hand", "interaction") if is_kind else ("phase", "hand")
        return all(self._is_word(name, touch.get(name)) for name in names)

    def _is_word(self, field: str, word: Any, words: list[str] | None = None) -> bool:  # noqa: ANN401
        words = words or self.feel["words"][field]
        if word not in words:
            listed = ", ".join(words)
            self._note(field, f"{word!r} is not one of {listed}: the call is refused")
        return word in words

    def _notes_milliseconds(self, hand: _Hand, phase: str, now: float) -> None:
        gap, hand.touched_at = now - hand.touched_at, now
        hand.gaps = hand.gaps + 1 if phase == "slide" and 5.0 <= gap <= 1000.0 else 0
        if hand.gaps == 3:
            self._note("now", f"{gap:g} s between the touches of a slide; pass s, not ms")

    def _clock(self, now: Any) -> float | None:  # noqa: ANN401
        if isinstance(now, (int, float)) and math.isfinite(now):
            return float(now)
        self._note("now", f"{now!r} is not a time in s: the call is refused")
        return None

    def _note(self, field: str, text: str) -> None:
        if field not in self.said:
            self.said.add(field)
            self._say(f"{field}: {text}")


@dataclass(kw_only=True)
class _Voice:
    """Something that sounds. `fade` moves to `aim`; at 0 with aim 0 the voice ends."""

    key: Any = None
    fade: float = 0.0
    aim: float = 0.0
    to: Any = None


@dataclass
class _Shot(_Voice):
    """An impact or a grain that sounds once; before 0, `at` waits for its begin."""

    clip: Json
    palm: float
    pad: float
    gain: float
    rate: float = 1.0
    hz: float = 0.0
    at: float = 0.0
    is_new: bool = True  # for a plan
    has_begun: bool = False

    def __post_init__(self) -> None:
        """Sound at once."""
        self.fade = self.aim = self.gain

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Return what sounds of it in the next `dt`, s."""
        del hand
        step = max(int(self.at / player.feel["rules"]["step_s"] + SOON), 0)
        drive, felt, hertz, body = (
            float(track[step]) if step < track.size else 0.0
            for track in (self.clip[name] for name in ("drive", "felt", "hz", "body"))
        )
        palm, pad = self.palm * self.fade, self.pad * self.fade
        gains = self.palm * before, palm, pad * drive, pad * felt, hertz, palm * body
        piece = Piece(self.clip, self.at, self.rate, *gains)
        self.at += self.rate * dt
        self.has_begun = True
        if (
            self.at >= self.clip["wave"].size / self.clip["rate_hz"]
            and step >= self.clip["drive"].size
        ):
            self.fade = self.aim = 0.0
        return [piece]


@dataclass
class _Layer(_Voice):
    """One loop of a texture. It follows speed, force, and the speed at which it is read."""

    clip: Json
    facts: Json
    at: float
    flow: State
    level: State = (0.0, 0.0)

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Return what sounds of it in the next `dt`, s."""
        del hand
        clip, old, (speed, force, pitch) = self.clip, self.level[0], self.to
        self.flow = player.smooth(self.flow, pitch, dt)
        rate, felt, hertz, loud, body = (
            player.look(clip[name], self.flow[0]) for name in ("rate", "felt", "hz", "loud", "body")
        )
        level = player.look(player.feel["levels"][self.facts["level"]], speed, force)
        target = self.facts["factor"] * level * player.look(clip["gain"], pitch)
        self.level = player.smooth(self.level, target, dt)
        gain = self.level[0] * self.fade
        step = int(self.at / player.feel["rules"]["step_s"] + SOON) % clip["drive"].size
        drive = gain * float(clip["drive"][step])
        gains = old * before * loud, gain * loud, drive, drive * felt, hertz, gain * body
        piece = Piece(clip, self.at, rate, *gains)
        self.at = (self.at + rate * dt) % (clip["wave"].size / clip["rate_hz"])
        return [piece]


@dataclass
class _Breaks(_Voice):
    """The fibres that break under a blade, a grain each. It follows speed and force."""

    facts: Json
    grain: str
    to_next: float
    level: State = (0.0, 0.0)

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Add the grain of the next `dt`, s, to the hand."""
        del before
        speed, force, _ = self.to
        target = player.look(player.feel["levels"][self.facts["level"]], speed, force)
        self.level = player.smooth(self.level, target, dt)
        per_s = player.look(self.facts["per_s"], speed)
        self.to_next -= per_s * dt
        if self.to_next < 0.0:
            gain = (0.4 + 0.6 * player.draw()) * self.level[0] * self.fade
            hand.voices.append(player.grain(self.grain, gain, dt + self.to_next / per_s))
            self.to_next = max(self.to_next + 0.5 + player.draw(), 0.0)
        return []


@dataclass
class _Press(_Voice):
    """A press on something that yields: a grain for each step that it deepens with the force."""

    facts: Json
    next: float
    gain: float
    depth: State = (0.0, 0.0)
    rest: float = 0.0  # s until another grain may begin

    def __post_init__(self) -> None:
        """Begin without a fade, at some place before the first step."""
        self.next, self.fade = 0.3 + 0.4 * self.next, self.gain

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Add the grain of the next `dt`, s, to the hand."""
        del before
        rules, old = player.feel["rules"], self.depth[0]
        self.depth = player.smooth(self.depth, self.to / self.facts["n_per_grain"], dt)
        deeper = self.depth[0] - old
        if self.depth[0] >= self.next and self.rest < dt:
            late_s = max(self.rest, dt * (self.next - old) / deeper if deeper > 0.0 else 0.0, 0.0)
            gain = rules["grain_strength"] * self.fade
            name = "grain" if late_s > self.rest else "again"
            hand.voices.append(player.grain(self.facts[name], gain, late_s))
            passed = old + deeper * late_s / dt - self.next
            self.next += math.floor(max(passed, 0.0)) + 1.0
            self.rest = late_s + 1.0 / rules["grains_per_s"]
        self.rest -= dt
        left = self.next - 1.0 - self.depth[0] - rules["grain_back"]
        if left > 0.0:
            self.next -= math.floor(left) + 1.0
        return []


@dataclass
class _Hum(_Voice):
    """A tone and its harmonics, which follow a hum; `fade` is its level."""

    turns: tuple[float, ...] = (0.0,) * 16

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Return what sounds of each harmonic in the next `dt`, s."""
        del hand
        pad, sound = player.feel["rules"]["pad"], player.feel["rules"]["sound"]
        pieces = []
        for order, (drive, turn) in enumerate(zip(self.to["drives"], self.turns, strict=False), 1):
            hertz = order * self.to["hz"]
            weight = np.interp(hertz, pad["hum_hz"], sound["hum_weight"]) if sound else 1.0
            felt = float(np.interp(hertz, pad["hum_hz"], pad["hum_felt"]))
            level, rate = drive * self.fade, hertz * (sound["times"] if sound else 1.0)
            gains = drive * before * weight, level * weight, level, level * felt, hertz
            pieces.append(Piece(SINE, turn, rate, *gains, level * math.sqrt(0.5)))
        moved = [(piece.at + piece.rate * dt) % 1.0 for piece in pieces]
        self.turns = (*moved, *self.turns[len(moved) :])
        return pieces


@dataclass
class _Hand:
    """One hand: its lease, its hold, and what sounds."""

    ends_at_once: bool  # as a plan does; samples fade
    is_held: bool = False
    is_armed: bool = False
    touches: bool = False
    lease_until: float | None = None
    time: float | None = None  # until which a plan has let it sound
    touched_at: float = 0.0
    gaps: int = 0
    voices: list[Any] = field(default_factory=list)

    def impacts(self) -> list[_Shot]:
        """Return the impacts that ring."""
        return [voice for voice in self.voices if voice.key in IMPACTS]

    def follow(self, key: Any, aim: float, to: Any, begin: Callable[[], list[Any]]) -> None:  # noqa: ANN401
        """Give the voices of a key what they follow, and begin them if there are none."""
        same = [voice for voice in self.voices if voice.key == key]
        if not same:
            same = begin()
            self.voices += same
        for voice in same:
            voice.key, voice.aim, voice.to = key, aim, to

    def fade(self) -> None:
        """Let fade what no touch goes on to want; impacts and grains ring."""
        for voice in self.voices:
            if not isinstance(voice, _Shot):
                voice.aim = 0.0

    def fork(self) -> _Hand:
        """Return a copy that may sound ahead."""
        fork = copy.copy(self)
        fork.voices = [copy.copy(voice) for voice in self.voices]
        return fork

    def let_go(self) -> None:
        """End what sounds: at once for a plan, with a fade for samples."""
        begun = [each for each in self.voices if each.key not in IMPACTS or each.has_begun]
        self.voices = [] if self.ends_at_once else begun
        self.time = None
        for voice in self.voices:
            voice.aim = 0.0

    def rest(self) -> None:
        """End the lease, and what sounds."""
        self.lease_until = None
        self.touches = False
        self.let_go()


def _powers(pieces: list[Piece]) -> Floats:
    """Return the squares of level, of loudness, and of level times frequency, (3,)."""
    each = [(one.drive, one.felt, one.drive * one.hz) for one in pieces] or [(0.0, 0.0, 0.0)]
    return np.asarray(np.square(each).sum(axis=0))


def _between(axis: list[float], value: float) -> tuple[int, float]:
    """Return the place of a value on an axis: the entry below it, and the share of the next one."""
    at = min(max(bisect.bisect_right(axis, value), 1), len(axis) - 1) - 1
    return at, min(max((value - axis[at]) / (axis[at + 1] - axis[at]), 0.0), 1.0)


def _blended(one: Json, other: Json, share: float) -> Json:
    """Return a clip between two of the same rate: 1 - share of the one, share of the other."""
    clip = dict(one)
    for name in ("wave", "drive", "felt", "hz", "body"):
        short, long = sorted((one[name], other[name]), key=len)
        weights = (1.0 - share, share) if short is one[name] else (share, 1.0 - share)
        clip[name] = weights[1] * long
        clip[name][: short.size] += weights[0] * short
    clip["most"] = (1.0 - share) * one["most"] + share * other["most"]
    return clip


def _read(clip: Json, at: float, rate: float, count: int) -> Any:  # noqa: ANN401
    """Return samples (count,) of a clip from `at`, s, on: a cubic through four of its samples."""
    wave = clip["wave"]
    places = at * clip["rate_hz"] + np.arange(count) * (rate * clip["rate_hz"])
    whole = np.floor(places).astype(int)
    share = places - whole
    if "gain" in clip:
        a, b, c, d = (wave[(whole + k) % wave.size] for k in (-1, 0, 1, 2))
    else:
        padded = np.concatenate(([0.0], wave, np.zeros(3)))
        a, b, c, d = (padded[np.clip(whole + k, 0, wave.size + 1)] for k in (0, 1, 2, 3))
    cubic = c - a + share * (2 * a - 5 * b + 4 * c - d + share * (3 * (b - c) + d - a))
    return b + 0.5 * share * cubic
