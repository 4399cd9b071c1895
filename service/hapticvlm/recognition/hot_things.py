"""Words of names that say how hot or cold a thing is to touch, with figures and sources. Pure.

A thing either says so by itself (an ice cube) or only in a state (a stove that is on): figures are
kept per state, "" being the bare name. Figures are of the surface a hand meets, not of the core.
They are round figures (docs/physics.md 7.3), so each comes with a wide interval.
Written from general knowledge and the names under data/models; see the training log of the
laboratory for how often it was wrong elsewhere. Reads no name; that is `temperature_words`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

State = Literal["", "on", "hot", "boiling", "warm", "cold", "frozen", "inside", "off"]


ROOM_C = 22.0


@dataclass(frozen=True, slots=True)
class Heat:
    """A surface temperature and the interval it is believed to lie in, degC, and its source."""

    value_c: float
    low_c: float
    high_c: float
    source: str

    @property
    def is_hot(self) -> bool:
        """Whether it is warmer than a room, not colder; no figure lies near the limit."""
        return self.value_c > ROOM_C


_HAND = "heat pain begins near 45 degC; served food and drink are above it; from memory"
WARM = Heat(38.0, 33.0, 45.0, "warm: above skin (33 degC) and below heat pain; from memory")
HOT = Heat(55.0, 43.0, 75.0, _HAND)
COLD = Heat(6.0, 1.0, 12.0, "kept in a refrigerator (4 degC) and just taken out; from memory")
FROZEN = Heat(-10.0, -18.0, 0.0, "between a freezer's -18 degC and melting; from memory")
MELTING = Heat(0.0, -18.0, 0.0, "ice melts at 0 degC and is no warmer than the air below that")
SERVED = Heat(55.0, 40.0, 75.0, "outside of a vessel of food served at 60 to 75 degC; from memory")
BOILED = Heat(90.0, 60.0, 100.0, "water boils at 100 degC at sea level; wall a little below")
FIRE = Heat(700.0, 400.0, 1100.0, "wood flames and embers; from memory")
COOKING = Heat(180.0, 80.0, 350.0, "hobs, griddles and coals in use; from memory")
STOVE = Heat(150.0, 50.0, 350.0, "outside of a burning stove or heater; from memory")
OVEN = Heat(50.0, 35.0, 70.0, "door of an oven in use, kept touchable by rule; from memory")
RADIATOR = Heat(50.0, 20.0, 75.0, "in use 45 to 60 degC, rated 75 (EN 442), or off; from memory")
BULB = Heat(60.0, 35.0, 150.0, "LED lamps 40 to 60 degC, filament bulbs 100 to 200; from memory")
SHADE = Heat(35.0, 22.0, 60.0, "lamp's body or shade when lit; from memory")
DEVICE = Heat(35.0, 26.0, 45.0, "laptops in use; IEC 62368-1 allows 48 degC held; from memory")
ENGINE = Heat(90.0, 60.0, 120.0, "coolant of a running engine is at 90 degC; from memory")
EXHAUST = Heat(200.0, 80.0, 400.0, "exhaust of a running engine; from memory")
BONNET = Heat(55.0, 35.0, 80.0, "over a running engine; from memory")
IRON = Heat(170.0, 80.0, 230.0, "soles of clothes irons, one to three dots; from memory")
SOLDER = Heat(350.0, 250.0, 400.0, "tip of a soldering iron; from memory")
POOL = Heat(38.0, 35.0, 40.0, "hot tubs are kept at no more than 40 degC; from memory")
BOTTLE = Heat(48.0, 38.0, 60.0, "cover of a filled hot-water bottle; from memory")
FRIDGE = Heat(4.0, 1.0, 8.0, "inside of a refrigerator; from memory")
FREEZER = Heat(-18.0, -22.0, -12.0, "three-star freezers hold -18 degC")
ICE_CREAM = Heat(-12.0, -18.0, -5.0, "served at about -12 degC; from memory")
ICE_PACK = Heat(0.0, -10.0, 5.0, "cold packs around melting; from memory")
DRY_ICE = Heat(-78.5, -80.0, -75.0, "carbon dioxide sublimes at -78.5 degC at 1 atm")
NITROGEN = Heat(-196.0, -196.0, -190.0, "nitrogen boils at -196 degC at 1 atm")
MAGMA = Heat(1100.0, 700.0, 1200.0, "basaltic magma; from memory")

_SERVABLE: dict[State, Heat] = {"hot": SERVED, "warm": WARM, "cold": COLD, "frozen": FROZEN}
_FAMILIES: tuple[tuple[Mapping[State, Heat], str], ...] = (
    (
        {"": MELTING, "cold": MELTING, "frozen": MELTING},
        """ice, ice cube, icecube, ice block, ice sheet, ice floe, ice wall, ice floor, ice cave,
        ice spike, ice shard, ice sculpture, ice rink, ice ball, icicle, iceberg, glacier, igloo,
        snow, snowball, snowman, snow man, snow ball, snow pile, snow bank, snow drift, snowdrift,
        snowbank, snow heap""",
    ),
    ({"": DRY_ICE}, "dry ice"),
    ({"": NITROGEN}, "liquid nitrogen"),
    ({"": ICE_CREAM}, "ice cream, icecream, popsicle, ice lolly, ice pop, gelato, sorbet"),
    ({"": ICE_PACK, "cold": ICE_PACK}, "ice pack, icepack, cold pack, ice bag, ice water"),
    ({"": COLD, "cold": COLD}, "iced tea, ice tea, iced coffee, ice coffee, cold brew"),
    ({"": FIRE, "on": FIRE, "hot": FIRE}, "campfire, camp fire, bonfire, fire, flame, ember"),
    ({"": MAGMA, "hot": MAGMA}, "magma, molten lava, molten metal, molten rock, molten steel"),
    ({"hot": MAGMA, "on": MAGMA}, "lava, lava flow, lava pool, lava lake"),
    ({"": RADIATOR, "on": RADIATOR, "hot": RADIATOR, "warm": WARM}, "radiator"),
    ({"": POOL, "hot": POOL, "warm": POOL}, "hot tub, hottub, jacuzzi, hot spring"),
    ({"": BOTTLE, "hot": BOTTLE, "warm": WARM}, "hot water bottle"),
    ({"": HOT, "hot": HOT}, "hot water, hot chocolate"),
    (
        {"": SERVED, "hot": SERVED, "boiling": BOILED, "warm": WARM, "cold": COLD},
        "soup, stew, broth, ramen",
    ),
    (
        _SERVABLE | {"boiling": BOILED},
        """mug, cup, teacup, tea cup, coffee cup, coffee mug, teapot, tea pot, coffee pot, coffee,
        tea, cocoa, espresso, cappuccino, latte, thermos, water""",
    ),
    (
        _SERVABLE,
        """water bottle, beer, beer bottle, beer can, soda, soda can, cola, coke, juice,
        milk, lemonade, cocktail, drink, beverage, smoothie, bottle, can, glass, wine, wine bottle,
        champagne, bowl, plate, dish, meal, food, lunch, dinner, pizza, bread, toast, pie, bun,
        steak, burger, potato, egg, noodle, rice, pasta, sandwich, sausage, bacon, chicken, fish,
        meat, beef, pea, vegetable, berry, pancake, waffle, cookie, cake""",
    ),
    ({"hot": HOT, "warm": WARM}, "towel, rock, stone, sand, pipe, engine block"),
    (
        {"frozen": MELTING},
        "lake, pond, river, puddle, waterfall, fountain, ground, window, tundra, sea",
    ),
    (
        {"hot": COOKING, "on": COOKING, "warm": WARM, "boiling": BOILED},
        "pan, frying pan, fryingpan, skillet, wok, griddle, saucepan, pot, cooking pot, cauldron",
    ),
    (
        {"on": COOKING, "hot": COOKING, "warm": WARM},
        """stove, stovetop, stove top, gas stove, electric stove, cooktop, hob, burner,
        stove burner, hotplate, hot plate, grill, barbecue, bbq""",
    ),
    (
        {"on": STOVE, "hot": STOVE, "warm": WARM},
        """heater, space heater, fireplace, fire place, fire pit, firepit, wood stove, furnace,
        boiler, brazier, forge, kiln, chimney, hearth, toaster""",
    ),
    ({"on": OVEN, "hot": OVEN, "warm": WARM}, "oven, microwave, microwave oven, dishwasher"),
    ({"on": BOILED, "hot": BOILED, "boiling": BOILED, "warm": WARM}, "kettle, tea kettle, samovar"),
    ({"on": BULB, "hot": BULB}, "bulb, light bulb, lightbulb, spotlight"),
    (
        {"on": SHADE, "hot": BULB},
        "lamp, desk lamp, floor lamp, table lamp, lantern, chandelier, street light, lamp shade",
    ),
    ({"on": FIRE, "hot": FIRE}, "log, firewood, charcoal, coal, hot coal"),
    (
        {"on": DEVICE, "hot": DEVICE, "warm": DEVICE},
        """laptop, computer, pc, console, game console, router, server, projector, charger, tv,
        television, monitor, phone, smartphone, tablet, amplifier""",
    ),
    ({"on": ENGINE, "hot": ENGINE, "warm": WARM}, "engine, motor, car engine, generator"),
    ({"on": EXHAUST, "hot": EXHAUST}, "exhaust, exhaust pipe, muffler, tailpipe"),
    (
        {"on": BONNET, "hot": BONNET, "warm": BONNET},
        "car hood, carhood, car bonnet, engine hood, bonnet",
    ),
    (
        {"on": IRON, "hot": IRON, "warm": WARM},
        "flat iron, clothes iron, steam iron, curling iron, ironing iron, hair straightener",
    ),
    ({"on": SOLDER, "hot": SOLDER}, "soldering iron"),
    ({"inside": FRIDGE}, "fridge, refrigerator, minifridge, mini fridge, icebox, ice box"),
    ({"inside": FREEZER}, "freezer, deep freezer, chest freezer"),
)

# What the words around a thing say of its state; a state that it has no figure for says nothing.
_STATES: dict[State, str] = {
    "on": """on, lit, burning, running, active, heated, ignited, turned on, switched on, on fire,
        powered on, aflame, glowing""",
    "hot": "hot, steaming, steam, steamy, scalding, piping hot, red hot, molten, sizzling",
    "boiling": "boiling",
    "warm": "warm, lukewarm",
    "cold": "cold, chilled, refrigerated, ice cold",
    "frozen": "frozen, snow covered, deep frozen",
    "inside": "inside, interior",
    "off": """off, unlit, extinguished, unheated, inactive, unplugged, turned off, switched off,
        powered off, burned out, burnt out""",
}
# The same, said by what follows "with": a mug with steam, a glass with ice.
_WITH: dict[State, str] = {
    "hot": "steam, hot water, hot chocolate",
    "cold": "ice, ice cube",
    "on": "fire, flame, ember",
}
# A colour after one of these names a colour: hot pink, ice blue, off white, snow white.
_ALSO_COLOURS = "hot, warm, cold, off, ice, snow, fire, flame, ember, lava, coffee, wine, glacier"
_COLOURS = """white, black, grey, gray, red, green, blue, yellow, pink, purple, brown, beige, ivory,
    navy, teal, orange, silver, gold, turquoise, cyan, magenta, violet, light, dark"""
# Words after a thing that change nothing of it, beside the noise of names.toml.
_MUTE = """small, large, big, tiny, huge, mini, tall, short, wide, narrow, long, old, modern,
    vintage, antique, classic, simple, basic, rustic, retro, left, right, top, bottom, upper, lower,
    prop, asset, collider, static, dynamic, item, pickup, main, kitchen, bathroom, bedroom,
    living room, office, garden, outdoor, indoor, interactable, grabbable, full"""
# Word runs that are none of the things their last words name, beside those of names.toml.
_FALSE_FRIENDS = """hot dog, hot pot, hot stone, hot glue, fire wall, jon snow, car radiator,
    cold steel, computer case, friendly fire, cease fire, cross fire, pine cone, cold stone,
    snow pea, hot sauce, fire glass, sea glass, search engine, game engine, sand stone, fire stone,
    black ice"""
_FAKES = "toy, plush, miniature, cartoon, decorative, inflatable, origami"


def _runs(words: str) -> list[tuple[str, ...]]:
    """Cut "ice cube, snow" into (("ice", "cube"), ("snow",))."""
    return [tuple(run.split()) for run in words.split(",")]


def _states(table: Mapping[State, str]) -> Mapping[tuple[str, ...], State]:
    return MappingProxyType({run: state for state, words in table.items() for run in _runs(words)})


THINGS: Mapping[tuple[str, ...], Mapping[State, Heat]] = MappingProxyType(
    {run: states for states, words in _FAMILIES for run in _runs(words)}
)
STATES = _states(_STATES)
WITH = _states(_WITH)
COLOURS = frozenset(_runs(_COLOURS))
ALSO_COLOURS = frozenset(_runs(_ALSO_COLOURS))
MUTE = frozenset(_runs(_MUTE))
FALSE_FRIENDS = frozenset(_runs(_FALSE_FRIENDS))
FAKES = frozenset(_runs(_FAKES))
VOCABULARY = frozenset(
    word
    for runs in (THINGS, STATES, WITH, COLOURS, MUTE, FALSE_FRIENDS, FAKES)
    for run in runs
    for word in run
)
LONGEST = max(map(len, THINGS))
