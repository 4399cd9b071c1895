"""Reads a temperature from a model's sentence, strictly. Pure; knows no model.

Accepted are a number in digits with its sign, and a range (its middle), in degrees Celsius or
without a unit. Numbers with a unit of temperature take precedence. Anything else is refused, such
as degrees Fahrenheit alone or two different numbers, because a wrong temperature would be felt and
a missing one is not.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from hapticvlm.vlm.contract import VlmError
from hapticvlm.vlm.limits import LEAST_C, MOST_C

# A number without a unit counts only beside these words: "I see 3 dogs" states no temperature.
_COMPANY = frozenset(
    (
        *("a", "about", "air", "ambient", "answer", "approximately", "around", "at", "be", "c"),
        *("between", "celsius", "could", "degrees", "estimate", "estimated", "here", "i", "in"),
        *("is", "it", "maybe", "minus", "my", "near", "of", "or", "outside", "perhaps", "place"),
        *("probably", "reads", "room", "roughly", "s", "say", "so", "temperature"),
        *("temperature_c", "the", "there", "thermometer", "this", "to", "would"),
    )
)
_DASHES = str.maketrans("\N{MINUS SIGN}\N{EN DASH}\N{EM DASH}\N{NON-BREAKING HYPHEN}", "----")
_MINUS_WORD = re.compile(r"\b(?:minus|negative)\s+(?=\d)")
# A number must not be part of a longer number, date, time, percentage or name.
_NOT_AFTER = r"(?!\s*(?:percent|hundred|thousand|million))"
_NUMBER = (
    rf"(?<![\w.,])(?<!\d[-/:])[-+]?\d{{1,3}}(?:[.,]\d{{1,2}})?(?![\d%])(?![.,:/]\d){_NOT_AFTER}"
)
_UNIT = (
    r"\s*(?:(?:°|º|\bdegrees?\b|\bdeg\b\.?)\s*)?"
    r"(?P<{0}>celsius\b|centigrade\b|c\b|fahrenheit\b|f\b|kelvin\b|k\b)?"
)
_DEGREES = r"(?P<degrees>\s*(?:°|º|\bdegrees?\b|\bdeg\b))?"
_QUANTITY = re.compile(rf"(?P<value>{_NUMBER})(?!\s*-\s*\d){_DEGREES}{_UNIT.format('unit')}")
_RANGE = re.compile(
    rf"(?P<between>\bbetween\s+)?(?P<low>{_NUMBER}){_UNIT.format('low_unit')}"
    r"\s*(?:-|to|(?(between)and|-))\s*"
    rf"(?P<high>[-+]?\d{{1,3}}(?:[.,]\d{{1,2}})?)(?![\d%])(?![.,:/]\d){_NOT_AFTER}{_DEGREES}"
    rf"{_UNIT.format('unit')}"
)


@dataclass(frozen=True, slots=True)
class Stated:
    """The range that a sentence states, degC; both ends are equal for a single number."""

    low_c: float
    high_c: float

    @property
    def value_c(self) -> float:
        """The middle of the range."""
        return (self.low_c + self.high_c) / 2


@dataclass(frozen=True, slots=True)
class _Quantity:
    low: float
    high: float
    unit: str  # c, f, k, "degrees" or "" for none


def read_celsius(text: str) -> Stated:
    """Read the one temperature that a text states. Raises VlmError if there is none or several."""
    quantities = _quantities(_with_signs(text))
    celsius = [quantity for quantity in quantities if quantity.unit == "c"]
    degrees = [quantity for quantity in quantities if quantity.unit == "degrees"]
    bare = [quantity for quantity in quantities if not quantity.unit]
    chosen = celsius or degrees or (bare if _is_bare(text) else [])
    stated = {(quantity.low, quantity.high) for quantity in chosen}
    if len(stated) != 1:
        raise _refusal(text, "several temperatures" if stated else "no temperature")
    low, high = stated.pop()
    if not LEAST_C <= low <= high <= MOST_C:
        raise _refusal(text, f"a temperature outside {LEAST_C} to {MOST_C} degC")
    return Stated(low, high)


def _with_signs(text: str) -> str:
    """Replace every dash by a hyphen, and the word minus before a number by a sign."""
    return _MINUS_WORD.sub("-", text.lower().translate(_DASHES))


def _quantities(text: str) -> list[_Quantity]:
    """Find all ranges, then all single numbers in the rest."""
    quantities = []
    for match in _RANGE.finditer(text):
        low, high = sorted((_value(match["low"]), _value(match["high"])))
        unit = match["unit"] or match["low_unit"] or ""
        quantities.append(_Quantity(low, high, unit[:1] or ("degrees" if match["degrees"] else "")))
    for match in _QUANTITY.finditer(_RANGE.sub(" ", text)):
        unit = (match["unit"] or "")[:1] or ("degrees" if match["degrees"] else "")
        quantities.append(_Quantity(_value(match["value"]), _value(match["value"]), unit))
    return quantities


def _is_bare(text: str) -> bool:
    """Whether all words beside the number are usual with a temperature."""
    return set(re.findall(r"[^\W\d]+", _with_signs(text))) <= _COMPANY


def _value(number: str) -> float:
    return float(number.replace(",", "."))


def _refusal(text: str, what: str) -> VlmError:
    excerpt = " ".join(text.split())[:80]
    return VlmError(f"the model's answer states {what}: `{excerpt}`")
