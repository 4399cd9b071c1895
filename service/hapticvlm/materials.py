"""The material table: what each class is to the skin, to the ear of the palm, and in words.

Knows facts and their sources only; nothing here measures, decides or renders. Thermal figures are
handbook values at room temperature as collected in the project's physics reference, section 1.2
(plywood, hardwood and softwood: Mechanical Engineers' Handbook vol. 4; the others from memory of
handbooks, so parameters and not claims). Effusivity e = sqrt(k rho c) follows from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType

UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Thermal:
    """Bulk thermal properties: k in W/(m K), rho in kg/m3, c in J/(kg K)."""

    conductivity: float
    density: float
    heat_capacity: float

    @property
    def effusivity(self) -> float:
        """Thermal effusivity in W s^0.5 / (m2 K)."""
        return math.sqrt(self.conductivity * self.density * self.heat_capacity)


@dataclass(frozen=True, slots=True)
class Mode:
    """One decaying mode of an impact: A sin(2 pi f t) exp(-B t), f in Hz, B in 1/s, A relative."""

    frequency_hz: float
    decay_per_s: float
    gain: float


@dataclass(frozen=True, slots=True)
class Vibration:
    """How a class sounds to the palm: impact modes, and the texture felt when rubbed.

    `pitch_m` is the dominant spatial period of the surface, `bandwidth` the width of the texture's
    band relative to its centre frequency speed / pitch, `roughness` its level (0..1).
    """

    modes: tuple[Mode, ...]
    pitch_m: float
    bandwidth: float
    roughness: float


@dataclass(frozen=True, slots=True)
class Material:
    """One class of the table."""

    name: str
    thermal: Thermal
    vibration: Vibration
    words: tuple[str, ...]


_THERMAL = {
    "wood": Thermal(0.16, 720, 1255),  # hardwood (oak, maple)
    "glass": Thermal(1.0, 2500, 840),  # soda-lime
    "fabric": Thermal(0.06, 320, 1300),  # cotton; k varies 0.04-0.08
    "metal": Thermal(15.0, 8000, 500),  # stainless 304; all metals feel within 1 degC of it
    "plastic": Thermal(0.18, 1050, 1400),  # ABS
    "stone": Thermal(2.8, 2700, 790),  # granite
    "ceramic": Thermal(1.5, 2400, 1000),  # porcelain
    "paper": Thermal(0.08, 700, 1340),  # cardboard
    "leather": Thermal(0.16, 900, 1500),
    "rubber": Thermal(0.16, 1100, 1900),
    "foliage": Thermal(0.4, 700, 3500),  # fresh leaf, mostly water; from memory, no source found
}

# Modes: wood 100 / 80, rubber 30 / 60 and metal (aluminium) 300 / 90 as Okamura, Cutkosky and
# Dennerlein, from memory; glass transposes a ringing preset (partials 1 : 1.86) into the band of
# touch; all others are our choice; the first four are set apart by more than the 18-30 % that
# frequencies must differ (physics reference 4.2, 4.3). Metal's close pair beats, as struck metal
# does. Pitches: our choice, coarse enough to be felt at 0.2 m/s; cloth is woven at 0.3-1 mm.
_VIBRATION = {
    "wood": Vibration((Mode(100, 80, 1.0), Mode(195, 150, 0.5)), 1.6e-3, 0.8, 0.6),
    "glass": Vibration((Mode(350, 30, 1.0), Mode(650, 60, 0.3)), 0.5e-3, 0.2, 0.1),
    "fabric": Vibration((Mode(45, 150, 1.0), Mode(80, 200, 0.3)), 1.0e-3, 0.5, 0.7),
    "metal": Vibration(
        (Mode(300, 90, 1.0), Mode(232, 16, 0.35), Mode(255, 16, 0.35)), 0.7e-3, 0.3, 0.3
    ),
    "plastic": Vibration((Mode(150, 110, 1.0), Mode(310, 180, 0.4)), 0.8e-3, 0.4, 0.3),
    "stone": Vibration((Mode(215, 130, 1.0), Mode(380, 150, 0.4)), 2.0e-3, 1.0, 0.8),
    "ceramic": Vibration((Mode(290, 60, 1.0), Mode(560, 90, 0.4)), 0.6e-3, 0.3, 0.2),
    "paper": Vibration((Mode(60, 160, 1.0), Mode(180, 250, 0.4)), 0.9e-3, 0.9, 0.3),
    "leather": Vibration((Mode(55, 120, 1.0), Mode(120, 180, 0.2)), 1.4e-3, 0.7, 0.5),
    "rubber": Vibration((Mode(30, 60, 1.0),), 1.2e-3, 0.6, 0.8),
    "foliage": Vibration((Mode(40, 180, 1.0), Mode(110, 250, 0.5)), 2.4e-3, 1.0, 0.4),
}

# Words that name the class itself, singular and in lower case; what objects imply is in
# recognition/names.toml.
_WORDS: dict[str, str] = {
    "wood": """
        wood wooden timber lumber plywood hardwood softwood oak pine walnut mahogany birch maple
        beech teak cedar spruce ebony rosewood bamboo rattan wicker driftwood parquet chipboard
        hardboard fibreboard fiberboard mdf osb log plank bark cork
    """,
    "glass": "glass glassware glazing windowpane glasspane crystal plexiglass wineglass hourglass",
    "fabric": """
        fabric cloth textile cotton linen wool woolen woollen silk satin velvet denim canvas felt
        fleece tweed polyester nylon burlap jute lace corduroy chenille cashmere tartan gauze
        muslin upholstery carpet rug curtain drapery tablecloth tapestry knit knitted
    """,
    "metal": """
        metal steel iron aluminium aluminum copper brass bronze chrome chromium titanium zinc
        nickel pewter tungsten cobalt stainless inox galvanized galvanised rust sheetmetal
        ironwork metalwork chainmail
    """,
    "plastic": """
        plastic polymer acrylic polycarbonate pvc vinyl abs polystyrene styrofoam polypropylene
        polyethylene polyurethane bakelite melamine perspex fiberglass fibreglass
    """,
    "stone": """
        stone rock granite marble limestone sandstone slate basalt travertine onyx quartz
        quartzite cobblestone flagstone brick brickwork concrete cement asphalt terrazzo gravel
        pebble boulder masonry stonework stucco plaster gypsum alabaster
    """,
    "ceramic": """
        ceramic porcelain earthenware stoneware terracotta faience majolica tile pottery crockery
    """,
    "paper": "paper cardboard paperboard papyrus parchment wallpaper newspaper",
    "leather": "leather suede nubuck cowhide",
    "rubber": "rubber latex neoprene silicone",
    "foliage": "leaf foliage grass lawn shrub hedge ivy moss fern plant houseplant",
}

MATERIALS = MappingProxyType(
    {
        name: Material(name, _THERMAL[name], _VIBRATION[name], tuple(_WORDS[name].split()))
        for name in _THERMAL
    }
)
