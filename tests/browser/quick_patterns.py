"""Four patterns of a study that take moments: two vibrations, each a degree warmer and colder."""

from __future__ import annotations

NAMES = {"tapping": ("glass", "tap"), "rubbing": ("fabric", "slide")}  # material, interaction
PATTERN = """
[[pattern]]
name = "{name}-{temperature}"
vibration = "{name}"
temperature = "{temperature}"
material = "{material}"
interaction = "{interaction}"
setpoint_c = {setpoint_c}
seconds = {seconds}
"""


def quick_patterns(seconds: float) -> str:
    """Return the patterns as a study's file states them."""
    return "".join(
        PATTERN.format(
            name=name,
            temperature=temperature,
            material=material,
            interaction=interaction,
            setpoint_c=setpoint_c,
            seconds=seconds,
        )
        for temperature, setpoint_c in (("hot", 33.0), ("cold", 31.0))
        for name, (material, interaction) in NAMES.items()
    )
