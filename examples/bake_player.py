"""The smallest player of a feel file of `hapticvlm bake`; docs/player.md explains each rule.

    feel = opened(json.load(open("feel.true.json")))
    player = Player(feel, lambda touch: {"material": "wood"})
    player.touch({"phase": "contact", "hand": "right", "speed_mps": 0.4, "force_n": 1.5}, seconds)
    player.plan("right", "parametric", seconds)  # the next 100 ms, for a controller

`Player(feel, surface_of, rate_hz=48000)` renders samples instead, `player.render(480, seconds)`.
It knows no clock: times are arguments, in s.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from feel_file import IMPACTS, Json
from numpy.typing import NDArray

TEXTURES = ("slide", "carve", "swing")
SOON = 1e-9
Floats = NDArray[np.float64]
State = tuple[float, float]  # value and slope of a smoothed number
# One turn of a sine as a loop: a hum is played as everything else, and its rate is its frequency.
SINE: Json = {
    "gain": None,
    "rate_hz": 32,
    "wave": np.sin(np.arange(32) * (np.pi / 16)),
    "drive": np.ones(1),
    "body": np.sqrt(0.5 * np.ones(1)),
}


class Piece(NamedTuple):
    """The sound of one clip for a moment. Positions are in s of the clip.

    `begin` and `end` are the gain of the samples, `pad` that of the tracks. `felt` and `hz` are
    those of a loop; a shot has them in its tracks.
    """

    clip: Json
    at: float
    wave_at: float
    wave_rate: float
    begin: float
    end: float
    pad: float
    felt: float | None = None
    hz: float = 0.0


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
        self._held = 0.0  # level that the compression of the sound voice follows
        self._compression: float | None = None
        self._hands = {name: _Hand() for name in feel["words"]["hand"]}

    def touch(self, touch: Json, now: float) -> bool:
        """Receive a touch at `now`, s; return whether an impact begins, which asks for a plan."""
        if self._clock(now) is None or not self._knows(touch):
            return False
        hand = self._hands[touch["hand"]]
        phase, interaction = touch["phase"], touch.get("interaction")
        if phase == "release":
            hand.is_armed = hand.is_held
            hand.rest(at_once=self.rate_hz is None)
            return False
        if hand.is_armed and phase in ("approach", "contact"):
            hand.is_held = hand.is_armed = False
        if hand.is_held:
            return False
        if hand.lease_until is not None and now > hand.lease_until:
            hand.rest(at_once=self.rate_hz is None)
        if self.rate_hz is None:
            self._run(hand, now)
        self._notes_milliseconds(hand, phase, now)
        onset = not hand.touches and phase == "contact"
        hand.lease_until = now + self.feel["rules"]["lease_s"]
        hand.touches = phase != "approach"
        if not hand.touches and interaction != "swing":
            hand.let_go(at_once=self.rate_hz is None)
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
            hand.rest(at_once=self.rate_hz is None)

    def plan(self, name: str, form: str, now: float) -> Json:
        """Return the next moments of a hand as a `vibration` event; empty lists are silence."""
        pad, step_s = self.feel["rules"]["pad"], self.feel["rules"]["step_s"]
        period_s = pad["period_s"][form]
        plan: Json = {"period_ms": 1000 * period_s, "amplitude": []}
        plan |= {"frequency_hz": [], "transients": []}
        hand, at = self._hands.get(name), self._clock(now)
        if hand is None or at is None or hand.lease_until is None:
            return plan
        if hand.lease_until <= at:
            hand.rest(at_once=True)
            return plan
        begun = [shot for shot in hand.shots if shot.kind in IMPACTS and shot.is_new]
        for shot in begun:
            shot.is_new = False
        self._run(hand, at)
        ahead, drawn = hand.fork(), self._drawn
        size = round(period_s / step_s)
        steps = round(pad["horizon_s"] / period_s) * size
        powers = np.array([self._power(self._pieces(ahead, step_s)) for _ in range(steps)])
        self._drawn = drawn
        drive, felt, turned = powers.reshape(-1, size, 3).mean(axis=1).T
        level = np.minimum(np.sqrt(felt if form == "amplitude" else drive), 1.0)
        amplitude = self._on_pad(level, form)
        if begun:
            first = amplitude[: round(pad["min_impact_s"] / period_s)]
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
                    hand.rest(at_once=False)
            dt = part.size / self.rate_hz
            pieces = [each for hand in self._hands.values() for each in self._pieces(hand, dt)]
            for one in pieces:
                read = _read(one.clip, one.wave_at, one.wave_rate / self.rate_hz, part.size)
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
        hand.hum = self._hum(surface.get("hum")) if hand.touches else None
        hand.texture = hand.press = None
        name = surface.get("material")
        facts = self.feel["materials"].get(name) if isinstance(name, str) else None
        if facts is None:
            if name not in (None, "unknown"):
                self._note("material", f"{name!r} is not in the feel file; bake it")
            return
        if kind == "press" and facts["n_per_grain"] is not None:
            hand.press = (name, facts, force, gain)
        if onset and kind != "swing":
            self._strike(hand, facts, kind if kind in IMPACTS else "tap", (speed, force), gain)
        if kind in TEXTURES:
            usual_m = facts["swing"]["thickness_m"]
            thin = usual_m / (thickness_m or usual_m) if kind == "swing" else 1.0
            hand.texture = ((name, kind, thin), facts, (speed, force), speed * thin)

    def _strike(self, hand: _Hand, facts: Json, kind: str, motion: State, gain: float) -> None:
        ringing = [shot for shot in hand.shots if shot.kind in IMPACTS]
        if len(ringing) >= self.feel["rules"]["max_impacts"]:
            return
        loud = [shot for shot in ringing if shot.aim > 0.0]
        if len(loud) >= self.feel["rules"]["max_ringing"]:
            loud[0].aim = 0.0
        table, impact = self.feel["impacts"][kind], facts[kind]
        contact_s = self.look(table["contact_s"], *motion)
        off = [abs(math.log(length / contact_s)) for length in impact["contact_s"]]
        clip = self.feel["clips"][impact["clips"][off.index(min(off))]]
        palm, pad = (
            min(impact[on] * self.look(table[on], *motion), clip["most"]) for on in ("palm", "pad")
        )
        rate = 1.0 + self.feel["rules"]["pitch_varies"] * (2.0 * self.draw() - 1.0)
        length = self._length(clip) / min(rate, 1.0)
        hand.shots.append(_Shot(clip, kind, palm, pad, length, gain, gain, rate, facts["hz"]))

    def _pieces(self, hand: _Hand, dt: float) -> list[Piece]:
        """Let a hand sound for `dt`, s; return what sounds."""
        self._follow(hand)
        pieces: list[Piece] = []
        step = dt / self.feel["rules"]["fade_s"]
        for voice in hand.voices:
            pieces += self._advance(voice, hand, step, dt)
        for shot in hand.shots:
            pieces += self._advance(shot, hand, step, dt)
        hand.drop_silent()
        return pieces

    def _advance(self, voice: Any, hand: _Hand, step: float, dt: float) -> list[Piece]:  # noqa: ANN401
        before = voice.fade
        voice.fade += min(max(voice.aim - voice.fade, -step), step)
        return list(voice.advance(self, hand, before, dt))

    def _follow(self, hand: _Hand) -> None:
        """Fade the voices of a hand towards its newest touch."""
        for voice in hand.voices:
            voice.aim = 0.0
        if hand.texture:
            self._follow_texture(hand, *hand.texture)
        if hand.press:
            name, facts, force, gain = hand.press
            if not any(press.key == name for press in hand.presses):
                first = 0.3 + 0.4 * self.draw()
                hand.presses.append(_Press(name, facts, first, gain, gain))
            for press in hand.presses:
                if press.key == name:
                    press.aim, press.force = gain, force
        if hand.hum:
            hand.hums = hand.hums or [_Hum(hand.hum)]
            hand.hums[0].aim, hand.hums[0].hum = hand.hum["level"], hand.hum

    def _follow_texture(
        self,
        hand: _Hand,
        key: Any,  # noqa: ANN401
        facts: Json,
        motion: State,
        pitch: float,
    ) -> None:
        same = [texture for texture in hand.textures if texture.key == key]
        if not same and len(hand.textures) <= self.feel["rules"]["max_textures"]:
            same = [self._texture(key, facts, pitch)]
            hand.textures += same
        for texture in same:
            texture.aim, texture.motion, texture.pitch = 1.0, motion, pitch

    def _texture(self, key: Any, facts: Json, pitch: float) -> _Texture:  # noqa: ANN401
        carve = facts["carve"] if key[1] == "carve" else None
        slide = facts["slide" if carve else key[1]]["layers"]
        layers = []
        for layer in carve["layers"] or slide if carve else slide:
            clip = self.feel["loops"][layer["loop"]]
            at = self.draw() * self.seconds(clip)
            layers.append(_Layer(clip, layer["level"], at, at))
        factor = carve["factor"] if carve else 1.0
        return _Texture(key, facts, factor, layers, self.draw(), (pitch, 0.0))

    def grain(self, facts: Json, gain: float) -> _Shot:
        """Return a grain of a material that begins now."""
        clip = self.feel["clips"][facts["grain"]]
        return _Shot(clip, "grain", gain, gain, self._length(clip))

    def seconds(self, clip: Json) -> float:
        """Return the length of a clip's tracks, s."""
        return float(clip["drive"].size * self.feel["rules"]["step_s"])

    def _length(self, clip: Json) -> float:
        return max(float(clip["wave"].size / clip["rate_hz"]), self.seconds(clip))

    def _power(self, pieces: list[Piece]) -> tuple[float, float, float]:
        """Return the squares of level, of loudness, and of level times frequency."""
        drive = felt = turned = 0.0
        step_s = self.feel["rules"]["step_s"]
        for clip, at, _, _, _, _, gain, loudness, hertz in pieces:
            level = gain * _track(clip, "drive", at, step_s)
            drive += level**2
            if loudness is None:
                felt += (gain * _track(clip, "felt", at, step_s)) ** 2
                turned += (level * _track(clip, "hz", at, step_s)) ** 2
            else:
                felt += (level * loudness) ** 2
                turned += (level * hertz) ** 2
        return drive, felt, turned

    def _gains(self, pieces: list[Piece], count: int, dt: float) -> Floats:
        """Return the compression of the sound voice, (count,); 1 in the true voice."""
        sound, gain = self.feel["rules"]["sound"], self._within("gain", self.gain, 1.0)
        if sound is None:
            return np.full(count, gain)
        body = sum(
            (each.end * _track(each.clip, "body", each.at, self.feel["rules"]["step_s"])) ** 2
            for each in pieces
        )
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
        while left > SOON and hand.sounds:
            self._pieces(hand, min(left, self.feel["rules"]["step_s"]))
            left -= self.feel["rules"]["step_s"]

    def look(self, table: Any, speed: float, force: float | None = None) -> float:  # noqa: ANN401
        """Return the value of a table at a speed, and at a force: linear between, held beyond."""
        rows = (
            [np.interp(force, self.feel["forces_n"], row) for row in table]
            if force is not None
            else table
        )
        return float(np.interp(speed, self.feel["speeds_mps"], rows))

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
        if not (
            level
            and hertz
            and is_list
            and all(isinstance(d, (int, float)) and abs(d) <= 100 for d in drives)
        ):
            self._note("hum", "needs frequency_hz, level and drives, as materials.json has them")
            return None
        return {"level": level, "hz": hertz, "drives": drives}

    def _knows(self, touch: Json) -> bool:
        for name in ("phase", "hand", "interaction"):
            word, words = touch.get(name), self.feel["words"][name]
            if word not in words and not (name == "interaction" and word is None):
                listed = ", ".join(words)
                self._note(name, f"{word!r} is not one of {listed}: the touch is refused")
                return False
        return True

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


@dataclass
class _Shot:
    """An impact or a grain that sounds once."""

    clip: Json
    kind: str
    palm: float
    pad: float
    seconds: float
    fade: float = 1.0
    aim: float = 1.0
    rate: float = 1.0
    hz: float = 0.0
    at: float = 0.0
    is_new: bool = True

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Return what sounds of it in the next `dt`, s."""
        del player, hand
        gains = self.palm * before, self.palm * self.fade, self.pad * self.fade
        piece = Piece(self.clip, self.at, self.at * self.rate, self.rate, *gains)
        self.at += dt
        if self.at >= self.seconds:
            self.fade = self.aim = 0.0
        return [piece]


@dataclass
class _Layer:
    """One loop of a texture; positions in s of its clip."""

    clip: Json
    table: Any
    at: float
    wave_at: float
    level: State = (0.0, 0.0)


@dataclass
class _Texture:
    """A slide, a carve or a swing over one material."""

    key: tuple[str, str, float]
    facts: Json
    factor: float
    layers: list[_Layer]
    to_next: float
    flow: State
    fade: float = 0.0
    aim: float = 1.0
    broken: State = (0.0, 0.0)
    motion: tuple[float, float] = (0.0, 0.0)
    pitch: float = 0.0  # speed at which the loops are read, m/s

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Return what sounds of its layers in the next `dt`, s; breaks are added to the hand."""
        self.flow = player.smooth(self.flow, self.pitch, dt)
        self.layers = [copy.copy(layer) for layer in self.layers]
        pieces = [self._layer(player, layer, before, dt) for layer in self.layers]
        carve = self.facts["carve"]
        if self.key[1] == "carve" and carve["per_s"]:
            target = player.look(carve["level"], *self.motion)
            self.broken = player.smooth(self.broken, target, dt)
            self.to_next -= player.look(carve["per_s"], self.motion[0]) * dt
            if self.to_next < 0.0:
                gain = (0.4 + 0.6 * player.draw()) * self.broken[0] * self.fade
                hand.shots.append(player.grain(self.facts, gain))
                self.to_next = max(self.to_next + 0.5 + player.draw(), 0.0)
        return pieces

    def _layer(self, player: Player, layer: _Layer, before: float, dt: float) -> Piece:
        clip, old = layer.clip, layer.level[0]
        rates = {name: player.look(clip[name], self.flow[0]) for name in ("rate", "wave_rate")}
        target = self.factor * player.look(layer.table, *self.motion)
        layer.level = player.smooth(layer.level, target * player.look(clip["gain"], self.pitch), dt)
        gain = layer.level[0] * self.fade
        felt, hertz = (player.look(clip[name], self.flow[0]) for name in ("felt", "hz"))
        gains = old * before, gain, gain
        piece = Piece(clip, layer.at, layer.wave_at, rates["wave_rate"], *gains, felt, hertz)
        layer.at = (layer.at + rates["rate"] * dt) % player.seconds(clip)
        layer.wave_at += rates["wave_rate"] * dt
        layer.wave_at %= clip["wave"].size / clip["rate_hz"]
        return piece


@dataclass
class _Press:
    """A press on something that yields: a grain for each step that it deepens."""

    key: str
    facts: Json
    next: float
    fade: float
    aim: float
    force: float = 0.0
    depth: State = (0.0, 0.0)
    rest: float = 0.0

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Add the grain of the next `dt`, s, to the hand."""
        del before
        rules = player.feel["rules"]
        self.depth = player.smooth(self.depth, self.force / self.facts["n_per_grain"], dt)
        self.rest -= dt
        if self.depth[0] >= self.next and self.rest <= 0.0:
            hand.shots.append(player.grain(self.facts, rules["grain_strength"] * self.fade))
            self.next += math.floor(self.depth[0] - self.next) + 1.0
            self.rest = 1.0 / rules["grains_per_s"]
        left = self.next - 1.0 - self.depth[0] - rules["grain_back"]
        if left > 0.0:
            self.next -= math.floor(left) + 1.0
        return []


@dataclass
class _Hum:
    """A tone and its harmonics; `fade` is its level."""

    hum: Json
    fade: float = 0.0
    aim: float = 0.0
    turns: tuple[float, ...] = (0.0,) * 16

    def advance(self, player: Player, hand: _Hand, before: float, dt: float) -> list[Piece]:
        """Return what sounds of each harmonic in the next `dt`, s."""
        del hand
        pad, sound = player.feel["rules"]["pad"], player.feel["rules"]["sound"]
        pieces = []
        for order, drive in enumerate(self.hum["drives"], start=1):
            hertz = order * self.hum["hz"]
            played = sound["times"] * hertz + sound["shift_hz"] if sound else hertz
            weight = np.interp(hertz, pad["hum_hz"], sound["hum_weight"]) if sound else 1.0
            felt = float(np.interp(hertz, pad["hum_hz"], pad["hum_felt"]))
            clip = {**SINE, "body": SINE["body"] / weight}
            gains = drive * before * weight, drive * self.fade * weight, drive * self.fade
            pieces.append(Piece(clip, 0.0, self.turns[order - 1], played, *gains, felt, hertz))
        moved = [
            (turn + piece.wave_rate * dt) % 1.0
            for turn, piece in zip(self.turns, pieces, strict=False)
        ]
        self.turns = (*moved, *self.turns[len(moved) :])
        return pieces


@dataclass
class _Hand:
    """One hand: its lease, its hold, what it was told last, and what sounds."""

    is_held: bool = False
    is_armed: bool = False
    touches: bool = False
    lease_until: float | None = None
    time: float | None = None  # until which a plan has let it sound
    touched_at: float = 0.0
    gaps: int = 0
    texture: Any = None
    press: Any = None
    hum: Json | None = None
    shots: list[_Shot] = field(default_factory=list)
    textures: list[_Texture] = field(default_factory=list)
    presses: list[_Press] = field(default_factory=list)
    hums: list[_Hum] = field(default_factory=list)

    @property
    def voices(self) -> list[Any]:
        """All that sounds, grains last: a voice before may add one that begins at once."""
        return [*self.textures, *self.presses, *self.hums]

    @property
    def sounds(self) -> bool:
        """Whether something sounds or is about to."""
        return bool(self.voices or self.shots or self.texture or self.press or self.hum)

    def fork(self) -> _Hand:
        """Return a copy that may sound ahead."""
        fork = copy.copy(self)
        for kind in ("shots", "textures", "presses", "hums"):
            setattr(fork, kind, [copy.copy(voice) for voice in getattr(self, kind)])
        return fork

    def drop_silent(self) -> None:
        """Drop the voices that have ended."""
        for kind in ("shots", "textures", "presses", "hums"):
            sounding = [voice for voice in getattr(self, kind) if voice.fade or voice.aim]
            setattr(self, kind, sounding)

    def let_go(self, *, at_once: bool) -> None:
        """End what sounds: at once for a plan, with a fade for samples."""
        self.texture = self.press = self.hum = None
        begun = [shot for shot in self.shots if shot.at or shot.kind not in IMPACTS]
        self.shots = [] if at_once else begun
        for shot in self.shots:
            shot.aim = 0.0
        if at_once:
            self.textures, self.presses, self.hums, self.time = [], [], [], None

    def rest(self, *, at_once: bool) -> None:
        """End the lease, and what sounds."""
        self.lease_until = None
        self.touches = False
        self.let_go(at_once=at_once)


def _track(clip: Json, name: str, at: float, step_s: float) -> float:
    """Return a track's value at a place, s: of the step that holds it; 0 after the end."""
    track, step = clip[name], int(at / step_s + SOON)
    if "gain" in clip:
        return float(track[step % track.size])
    return float(track[step]) if step < track.size else 0.0


def _read(clip: Json, at: float, rate: float, count: int) -> Floats:
    """Return samples (count,) of a clip from `at`, s, on: a cubic through four of its samples."""
    wave = clip["wave"]
    places = at * clip["rate_hz"] + np.arange(count) * (rate * clip["rate_hz"])
    whole = places.astype(int)
    share = places - whole
    if "gain" in clip:
        a, b, c, d = (wave[(whole + k) % wave.size] for k in (-1, 0, 1, 2))
    else:
        padded = np.concatenate(([0.0], wave, np.zeros(3)))
        a, b, c, d = (padded[np.minimum(whole + k, wave.size + 1)] for k in (0, 1, 2, 3))
    cubic = c - a + share * (2 * a - 5 * b + 4 * c - d + share * (3 * (b - c) + d - a))
    return np.asarray(b + 0.5 * share * cubic)
