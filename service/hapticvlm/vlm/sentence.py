"""Reads a temperature from a model's answer, strictly. Pure; knows no model.

Accepted are a number in digits with its sign, a number with its uncertainty, and a range (its
middle), in degrees Celsius or without a unit; or a JSON object with one temperature. Numbers with a
unit of temperature take precedence. A number counts only if the words of its clause allow it: with
the unit Celsius any but those of a comparison ("below", "warmer"), else only those that usually
stand beside a temperature. Anything else is refused, such as degrees Fahrenheit alone, angles, or
two different numbers, because a wrong temperature would be felt and a missing one is not.
"""

from __future__ import annotations

import json
import re
import unicodedata
from dataclasses import dataclass

from hapticvlm.vlm.contract import VlmError
from hapticvlm.vlm.limits import LEAST_C, MOST_C, MOST_WIDTH_C

# A number without the unit Celsius counts only beside these words: "I see 3 dogs" and "a 45 degree
# camera angle" state no temperature.
_COMPANY_WORDS = """
    a about ambient answer appears approximately air around at be c celsius cold comfortable cool
    could day degrees degree deg estimate estimated feels final for here hot i image in indoor
    indoors is ish it like likely looks maybe mild minus my near of on or outdoor outdoors outside
    perhaps photo picture place probably reads room roughly s say scene seems so temperature temp
    the there thermometer this to unit value warm weather would
"""
_COMPANY = frozenset(_COMPANY_WORDS.split())
# Beside one of these a number is a bound, a difference or an angle, whatever its unit.
_COMPARING_WORDS = """
    above angle below beyond change colder cooler decrease difference drop exceed exceeding exceeds
    except hotter higher increase isn latitude least less longitude lower max maximum min minimum
    more most never not over rise rotation slope t than tilt under up view warmer within without
"""
_NOT_A_STATEMENT = frozenset(_COMPARING_WORDS.split())
_DASHES = str.maketrans("\N{MINUS SIGN}\N{EN DASH}\N{EM DASH}\N{NON-BREAKING HYPHEN}", "----")
_MINUS_WORD = re.compile(r"\b(?:minus|negative)\s+(?=\d)")
_LIST_MARK = re.compile(r"^\s*\d[.)]\s+(?=\S)")
# Chinese, Japanese and Korean write the unit around the number, without spaces.
_EAST_ASIAN = re.compile(
    r"(?:摄氏|攝氏|摂氏|섭씨)\s*(?P<before>-?\d+(?:\.\d+)?)\s*[度도]"
    r"|(?P<after>-?\d+(?:\.\d+)?)\s*(?:摄氏度|攝氏度|摂氏度)"
)
# A number must not be part of a longer number, date, time, percentage, name or decade.
_NOT_AFTER = r"(?!\s*(?:percent|hundred|thousand|million))(?!s\b)"
_NUMBER = (
    rf"(?<![\w.,])(?<!\d[-/:])[-+]?\d{{1,3}}(?:[.,]\d{{1,2}})?(?![\d%])(?![.,:/]\d){_NOT_AFTER}"
)
_DEGREE = r"(?:°|\bdegrees?\b|\bdeg\b\.?|\bgrad\b|\bgrados?\b|\bgradi\b|\bgraus\b|\bdegrés?\b)"
_UNIT = rf"\s*(?:{_DEGREE}\s*)?(?P<{{0}}>celsius\b|centigrade\b|c\b|fahrenheit\b|f\b|kelvin\b|k\b)?"
_DEGREES = rf"(?P<degrees>\s*{_DEGREE})?"
_QUANTITY = re.compile(rf"(?P<value>{_NUMBER})(?!\s*-\s*\d){_DEGREES}{_UNIT.format('unit')}")
_UNCERTAIN = re.compile(
    rf"(?P<value>{_NUMBER}){_UNIT.format('value_unit')}\s*\(?\s*(?:±|\+/-|\+-)\s*"
    rf"(?P<by>\d{{1,2}}(?:[.,]\d{{1,2}})?){_DEGREES}{_UNIT.format('unit')}\s*\)?"
    rf"(?P<late_degrees>\s*{_DEGREE})?{_UNIT.format('late_unit')}"
)
_RANGE = re.compile(
    rf"(?P<between>\bbetween\s+)?(?P<low>{_NUMBER}){_UNIT.format('low_unit')}"
    r"\s*(?:-|~|to|bis|(?(between)and|-))\s*"
    rf"(?P<high>[-+]?\d{{1,3}}(?:[.,]\d{{1,2}})?)(?![\d%])(?![.,:/]\d){_NOT_AFTER}{_DEGREES}"
    rf"{_UNIT.format('unit')}"
)
_EITHER = re.compile(rf"{_NUMBER}{_UNIT.format('unit')}\s*(?:\bor\b|/|,)\s*{_NUMBER}")
_CLAUSE_ENDS = re.compile(r"[;!?\n]|[.,](?!\d)|\band\b|\bbut\b")
_UNITS = ("unit", "late_unit", "value_unit", "low_unit")
_TEMPERATURE_KEY = re.compile(r"temp|celsius|degrees|answer")
_OTHER_KEY = re.compile(r"fahrenheit|kelvin|(?:_|\b)[fk]$")


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
    """A number or range. `unit`: c, f, k, "degrees" or "" for none; `words`: of its clause."""

    low: float
    high: float
    unit: str
    words: frozenset[str]

    @property
    def is_stated(self) -> bool:
        """Whether its clause states it as a temperature, rather than comparing or counting."""
        if self.words & _NOT_A_STATEMENT or self.high - self.low > MOST_WIDTH_C:
            return False
        is_told = self.unit == "degrees" and "temperature" in self.words
        return self.unit == "c" or is_told or self.words <= _COMPANY


def read_celsius(text: str) -> Stated:
    """Read the one temperature that a text states. Raises VlmError if there is none or several."""
    plain = _plain(_of_object(text))
    if _EITHER.search(plain):
        raise _refusal(text, "several temperatures")
    ends = _ends(plain)
    if len(ends) != 1:
        raise _refusal(text, "several temperatures" if ends else "no temperature")
    low, high = ends.pop()
    if not LEAST_C <= low <= high <= MOST_C:
        raise _refusal(text, f"a temperature outside {LEAST_C} to {MOST_C} degC")
    return Stated(low, high)


def _ends(plain: str) -> set[tuple[float, float]]:
    """Return the lowest and highest degC of each temperature that counts, by the best unit."""
    stated = [quantity for quantity in _quantities(plain) if quantity.is_stated]
    by_unit = {
        unit: [each for each in stated if each.unit == unit] for unit in ("c", "degrees", "")
    }
    # Without any unit the whole answer must be about a temperature, not only the number's clause.
    if not set(re.findall(r"[^\W\d_]+", plain)) <= _COMPANY:
        del by_unit[""]
    best = next((quantities for quantities in by_unit.values() if quantities), [])
    return {(quantity.low, quantity.high) for quantity in best}


def _of_object(text: str) -> str:
    """Return the temperature of an answer that is a JSON object; any other text as it is."""
    try:
        answer = json.loads(text)
    except (ValueError, RecursionError):
        return text
    if not isinstance(answer, dict):
        return text
    names = [
        name
        for name in answer
        if _TEMPERATURE_KEY.search(name.lower()) and not _OTHER_KEY.search(name.lower())
    ]
    units = [str(value) for name, value in answer.items() if "unit" in name.lower()]
    return " ".join([str(answer[names[0]]), *units]) if len(names) == 1 else text


def _plain(text: str) -> str:
    """Write signs, units and numbers in one way: hyphens, degC signs in two letters, digits."""
    # NFKC turns the one-character degC sign and full-width digits into plain ones. It would turn
    # the ordinal sign, which some type for a degree sign, into the letter o.
    text = unicodedata.normalize("NFKC", text.replace("\N{MASCULINE ORDINAL INDICATOR}", "°"))
    text = _LIST_MARK.sub("", text.lower().translate(_DASHES))
    text = _EAST_ASIAN.sub(lambda match: f" {match['before'] or match['after']} celsius ", text)
    return _MINUS_WORD.sub("-", text)


def _quantities(text: str) -> list[_Quantity]:
    """Find all numbers with an uncertainty, then all ranges, then all single numbers."""
    quantities = []
    for pattern in (_UNCERTAIN, _RANGE, _QUANTITY):
        rest = text
        for match in pattern.finditer(text):
            quantities.append(_quantity(match, _words(text, match)))
            blank = " " * (match.end() - match.start())
            rest = rest[: match.start()] + blank + rest[match.end() :]
        text = rest
    return quantities


def _quantity(match: re.Match[str], words: frozenset[str]) -> _Quantity:
    groups = match.groupdict()
    unit = next((groups[name] for name in _UNITS if groups.get(name)), "")[:1]
    has_degrees = groups.get("degrees") or groups.get("late_degrees")
    low = _value(groups.get("value") or groups["low"])
    high = _value(groups.get("value") or groups["high"])
    by = _value(groups.get("by") or "0")
    low, high = sorted((low - by, high + by))
    return _Quantity(low, high, unit or ("degrees" if has_degrees else ""), words)


def _words(text: str, match: re.Match[str]) -> frozenset[str]:
    """Return the words of the clause that a match stands in, without the match itself."""
    before = _CLAUSE_ENDS.split(text[: match.start()])[-1]
    after = _CLAUSE_ENDS.split(text[match.end() :])[0]
    words = re.findall(r"[^\W\d_]+", f"{before} {after}")
    return frozenset(words) | ({"than"} if re.search("[<>≤≥]", before) else frozenset())


def _value(number: str) -> float:
    return float(number.replace(",", "."))


def _refusal(text: str, what: str) -> VlmError:
    excerpt = " ".join(text.split())[:80]
    return VlmError(f"the model's answer states {what}: `{excerpt}`")
