"""Computes one touch of a material by the models of the service: `hapticvlm.feel`.

The command `feel` is this too. It uses neither a service nor a device. heat.py has
the thermal half, sound.py the vibration.
"""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.errors import UsageError
from hapticvlm.materials import Material, find, nearest
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering import touch_ranges
from hapticvlm.rendering.vibration import wav
from hapticvlm.rendering.vibration.sound_voice import as_sound, in_voice
from hapticvlm.rendering.vibration.vibration import INTERACTIONS, RATE_HZ, VOICES, Motion
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm.touches import OWNED, ahap, haptic, owned
from hapticvlm.touches.clip import Clip, clip, for_controllers
from hapticvlm.touches.drawing import Drawing, draw
from hapticvlm.touches.heat import Heat, ThermalInputs, heat
from hapticvlm.touches.sound import Sound, sound

AMBIENT_C = 22.0
SPEED_MPS = 0.3
SWING_MPS = 5.0
KINDS = ("wav", "haptic", "ahap")
SCALES = ("palm", "controller")
HEARD_EVERY = 4  # sample of the sound voice, whose band ends below 5 kHz
HEAT_SUFFIX = ".heat.json"


@dataclass(frozen=True, slots=True, eq=False)  # numpy does not say whether arrays are equal
class FeltTouch:
    """A touch: the skin on the real object, the plate, and the vibration.

    - `heat`: the temperatures, what they follow from, and the limits that acted.
    - `sound`: the vibration with its material and motion; `sound.describe()` has its spectrum.

    A notebook shows its drawing and plays its sound; `print` and `repr` say it in three lines.
    """

    heat: Heat
    sound: Sound

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Times of `skin_c` and `plate_c` after contact, (T,) in s, every 0.02 s from 0."""
        return np.array(self.heat.time_s)

    @property
    def skin_c(self) -> NDArray[np.float64]:
        """Temperature of skin that touches the real object, (T,) in degC (docs/physics.md 1.1)."""
        return np.array(self.heat.skin_c)

    @property
    def plate_c(self) -> NDArray[np.float64]:
        """Setpoint of the plate, within its limits, that gives the skin this, (T,) in degC."""
        return np.array(self.heat.setpoint_c)

    @property
    def vibration(self) -> NDArray[np.float32]:
        """The wave that the palm speaker plays, (N,) in -1..1 of full scale at `rate_hz`."""
        return self.sound.wave

    @property
    def rate_hz(self) -> int:
        """Sample rate of `vibration` in Hz."""
        return RATE_HZ

    def on(self, output: str) -> FeltTouch:
        """Return the touch as an output that people own plays it: what is lost is heard and seen.

        `output` is one of `hapticvlm.touches.OWNED`; owned.py says what each plays.
        Raises `HapticVLMError` for another.
        """
        if output not in OWNED:
            raise UsageError(f"on: `{output}` is not one of {', '.join(OWNED)}; choose one")
        return FeltTouch(owned.heat_on(output, self.heat), owned.sound_on(output, self.sound))

    def plot(self) -> Drawing:
        """Draw temperatures, vibration and spectrum; a notebook shows it. It needs no library.

        hapticvlm.feel("metal", object_c=5).plot().save("touch.svg")
        """
        return draw(self.heat, self.sound)

    def clip(self, scale: str = "palm") -> Clip:
        """Return the touch as haptic formats hold it; `save` has the scales. Raises UsageError."""
        if scale not in SCALES:
            raise UsageError(f"scale: `{scale}` is not one of {', '.join(SCALES)}; choose one")
        whole = clip(self.sound, self.heat)
        return for_controllers(whole) if scale == "controller" else whole

    def save(self, path: str | Path, *, scale: str = "palm", voice: str = "true") -> list[Path]:
        """Write the touch as a file for other tools; its ending is the format.

        - `path`: .wav (16 bit, 48 kHz, mono), .haptic (Meta Haptics SDK) or .ahap (Apple Core
          Haptics).
        - `scale`: `palm` (as the palm speaker plays it) or `controller` (raises what controllers
          and phones would hardly play; a .wav does not change).
        - `voice`: of a .wav: `true` (for a palm speaker) or `sound` (the same for ears).

        Returns the paths written: no format holds temperatures, so a second file, PATH.heat.json,
        has them. Raises OSError, and `HapticVLMError` for another ending, scale or
        voice.

            hapticvlm.feel("glass", "tap").save("glass.haptic", scale="controller")
        """
        path = Path(path)
        kind = path.suffix.lower().removeprefix(".")
        if kind not in KINDS:
            endings = ", ".join(f".{known}" for known in KINDS)
            raise UsageError(f"{path}: `{path.suffix}` is not one of {endings}; choose one of them")
        if voice not in VOICES or (voice != VOICES[0] and kind != "wav"):
            raise UsageError(f"voice: `{voice}` is not one of {', '.join(VOICES)} of a .wav")
        whole = self.clip(scale)
        return save_clip(replace(whole, wave=in_voice(whole.wave, voice)), kind, path)

    def __repr__(self) -> str:
        heat, felt = self.heat, self.sound.describe()
        levels = felt["spectrum"]["level_db"]
        loudest_hz = felt["spectrum"]["frequency_hz"][levels.index(max(levels))]
        return (
            f"{heat.material} at {heat.surface_c:g} degC, {felt['interaction']}, "
            f"{felt['seconds']:g} s\n"
            f"skin from {heat.skin_c[0]:.1f} to {heat.skin_c[-1]:.1f} degC, "
            f"plate at {heat.setpoint_c[-1]:.1f} degC\n"
            f"vibration strongest near {loudest_hz:.0f} Hz, peak {felt['peak']:.2f} of full scale"
        )

    def _repr_html_(self) -> str:
        heard = wav.encoded(as_sound(self.vibration)[::HEARD_EVERY], RATE_HZ // HEARD_EVERY)
        address = f"data:audio/wav;base64,{base64.b64encode(heard).decode()}"
        return f'{self.plot().svg}<br><audio controls src="{address}"></audio>'


def feel(
    material: str | Material,
    interaction: str | None = None,
    *,
    object_c: float | None = None,
    ambient_c: float = AMBIENT_C,
    skin_c: float = NEUTRAL_C,
    contact_resistance: float | None = None,
    thickness_m: float | None = None,
    speed_mps: float | None = None,
    force_n: float = 1.0,
    seconds: float = 5.0,
    voices: Voices | None = None,
) -> FeltTouch:
    """Compute what touching a material feels like, by the models that the service renders with.

    - `material`: a name of `hapticvlm.MATERIALS`, or a material of your own
      (`hapticvlm.materials.derive`).
    - `interaction`: `tap`, `strike`, `press`, `slide`, `carve` or `swing`; None: a strike, then a
      slide from 0.4 s on.
    - `object_c`, `ambient_c`, `skin_c`: temperatures in degC of the object (None: that of the
      room), of the room, and of the skin before the touch.
    - `contact_resistance`: of skin and object in m2 K/W (None: that of the material).
    - `thickness_m`: of an object that is a sheet or a rod, in m (None: thick).
    - `speed_mps`: highest speed of a stroke, or the speed of an impact, in m/s (None: 0.3; swing
      5).
    - `force_n`: force of the hand in N.
    - `seconds`: length of the touch.
    - `voices`: a mixer with recordings or a corrected speaker; None synthesises.

    Raises `HapticVLMError` for an unknown material (it names the nearest) or interaction, and for a
    quantity out of range (it names the range). docs/physics.md has the models and their sources.

        touch = hapticvlm.feel("wood", "slide", object_c=5, speed_mps=0.2)
        touch.skin_c[-1], touch.vibration.max()
    """
    facts = find(material) if isinstance(material, str) else material
    if interaction is not None and interaction not in INTERACTIONS:
        raise UsageError(f"no interaction `{interaction[:40]}`{nearest(interaction, INTERACTIONS)}")
    usual_mps = SWING_MPS if interaction == "swing" else SPEED_MPS
    motion = Motion(usual_mps if speed_mps is None else speed_mps, force_n)
    inputs = ThermalInputs(object_c, ambient_c, skin_c, contact_resistance, thickness_m)
    touch_ranges.check(
        object_c=object_c,
        ambient_c=ambient_c,
        skin_c=skin_c,
        contact_resistance=contact_resistance,
        thickness_m=thickness_m,
        speed_mps=motion.speed_mps,
        force_n=force_n,
        seconds=seconds,
    )
    return FeltTouch(
        heat(facts, inputs, seconds),
        sound(facts, interaction, motion, seconds, voices, thickness_m),
    )


def save_clip(of: Clip, kind: str, path: Path) -> list[Path]:
    """Write a clip, and its temperatures to a second file.

    Returns the paths written. Raises OSError.
    """
    if kind == "wav":
        wav.write(path, of.wave)
    else:
        _write_json(path, haptic.document(of) if kind == "haptic" else ahap.document(of))
    heat_path = path.with_name(path.name + HEAT_SUFFIX)
    _write_json(heat_path, heat_document(of.heat))
    return [path, heat_path]


def heat_document(of: Heat) -> dict[str, Any]:
    """Return the temperatures of a touch from contact on, in degC, times in s."""
    return {
        "material": of.material,
        "surface_c": of.surface_c,
        "contact_c": round(of.contact_c, 2),
        "time_s": of.time_s,
        "skin_c": [round(celsius, 2) for celsius in of.skin_c],
        "setpoint_c": [round(celsius, 2) for celsius in of.setpoint_c],
    }


def _write_json(path: Path, document: dict[str, Any]) -> None:
    documents.replace_file(path, json.dumps(document, indent=1) + "\n")
