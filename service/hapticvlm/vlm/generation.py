"""From a model's sentence to a temperature: a strict reading of text. Pure; knows no model.

Read are a number in digits or English words with its sign, a range (its middle), and degrees
Fahrenheit where they are stated. A number with a unit of temperature counts before one without.
Anything else, also two numbers that contradict each other, is no answer: a wrong number would be
felt, none is not.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from hapticvlm.vlm.contract import LEAST_C, MOST_C, VlmError

MOST_TOKENS = 24  # a number and a few words; what a model writes after that is not read
# A sentence states no interval. The paper counts an answer within 8 degC of the truth as right and
# had 13 of 15 right, so +- 8 degC is what is known to hold about COVERAGE of such answers.
HALF_WIDTH_C = 8.0

_ONES = {
    word: number
    for number, word in enumerate(
        (
            *("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"),
            *("ten", "eleven", "twelve", "thirteen", "fourteen", "fifteen", "sixteen"),
            *("seventeen", "eighteen", "nineteen"),
        )
    )
}
_TENS = {
    word: 10 * number
    for number, word in enumerate(
        ("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"), start=2
    )
}
# A number without a unit counts only in such company: "I see 3 dogs" states no temperature.
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
_TENS_WORD = "|".join(_TENS)
_ONES_WORD = "|".join(_ONES)
_WORDS = re.compile(
    rf"\b(?:(?P<tens>{_TENS_WORD})(?:[\s-]+(?P<digit>{_ONES_WORD}))?|(?P<ones>{_ONES_WORD}))\b"
)
_MINUS_WORD = re.compile(r"\b(?:minus|negative)\s+(?=\d)")
# No part of a longer number, date, time, share or name.
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
    """A temperature that was stated, degC: a number, or the middle of low to high."""

    value_c: float
    low_c: float
    high_c: float


@dataclass(frozen=True, slots=True)
class _Found:
    low: float
    high: float
    unit: str  # c, f, k, "degrees" or "" for none


def read_celsius(text: str) -> Stated:
    """Read the one temperature that a text states. Raises VlmError where there is none."""
    found = _quantities(_in_digits(text))
    united = [quantity for quantity in found if quantity.unit in ("c", "f")]
    celsius = [quantity for quantity in united if quantity.unit == "c"]
    degrees = [quantity for quantity in found if quantity.unit == "degrees"]
    chosen = celsius or united or degrees or (found if _is_bare(text) else [])
    stated = {_in_celsius(quantity) for quantity in chosen if quantity.unit != "k"}
    if len(stated) != 1:
        raise _nonsense(text, "several temperatures" if stated else "no temperature")
    low, high = stated.pop()
    if not LEAST_C <= low <= high <= MOST_C:
        raise _nonsense(text, f"a temperature outside {LEAST_C} to {MOST_C} degC")
    return Stated((low + high) / 2, low, high)


def interval(stated: Stated) -> tuple[float, float]:
    """Return the interval to believe of what was stated: at least HALF_WIDTH_C each way, degC."""
    low = min(stated.low_c, stated.value_c - HALF_WIDTH_C)
    return low, max(stated.high_c, stated.value_c + HALF_WIDTH_C)


def _in_digits(text: str) -> str:
    """Write number words as digits, every dash as a hyphen, and minus as a sign."""
    text = _WORDS.sub(_digits, text.lower().translate(_DASHES))
    return _MINUS_WORD.sub("-", text)


def _digits(match: re.Match[str]) -> str:
    tens = match["tens"]
    digit = match["digit"]
    ones = match["ones"]
    if tens is None:
        return str(_ONES[ones])
    if digit is not None and not 1 <= _ONES[digit] <= 9:  # "twenty eleven" is no number
        return match[0]
    return str(_TENS[tens] + (_ONES[digit] if digit is not None else 0))


def _quantities(text: str) -> list[_Found]:
    """Find all ranges, then all single numbers in what is left."""
    found = []
    for match in _RANGE.finditer(text):
        low, high = sorted((_value(match["low"]), _value(match["high"])))
        unit = match["unit"] or match["low_unit"] or ""
        found.append(_Found(low, high, unit[:1] or ("degrees" if match["degrees"] else "")))
    for match in _QUANTITY.finditer(_RANGE.sub(" ", text)):
        unit = (match["unit"] or "")[:1] or ("degrees" if match["degrees"] else "")
        found.append(_Found(_value(match["value"]), _value(match["value"]), unit))
    return found


def _is_bare(text: str) -> bool:
    """Whether words that go with a temperature are the only ones beside the number."""
    return set(re.findall(r"[^\W\d]+", _in_digits(text))) <= _COMPANY


def _value(number: str) -> float:
    return float(number.replace(",", "."))


def _in_celsius(quantity: _Found) -> tuple[float, float]:
    if quantity.unit != "f":
        return quantity.low, quantity.high
    return round((quantity.low - 32.0) / 1.8, 1), round((quantity.high - 32.0) / 1.8, 1)


def _nonsense(text: str, what: str) -> VlmError:
    excerpt = " ".join(text.split())[:80]
    return VlmError(f"the model's answer states {what}: `{excerpt}`")
