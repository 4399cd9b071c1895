"""Reads a temperature from a model's answer by matching the whole of it. Pure; knows no model.

An answer is a number, a number with its uncertainty or a range, in degrees Celsius or without a
unit, alone or in one of the frames below ("the temperature is about ...", "il fait environ ..."),
each language with its own minus; or a JSON object with one temperature. A text of which any part
fits no frame is not read, so bounds, denials, other things' temperatures and second numbers need no
list of words that exclude them. A wrong temperature would be felt and a missing one is not.
"""

from __future__ import annotations

# ruff: noqa: RUF001 - Cyrillic letters that look like Latin ones are meant
import json
import re
import unicodedata
from dataclasses import dataclass

from hapticvlm.vlm.answer_text import UnreadError, unmarked
from hapticvlm.vlm.limits import LEAST_C, MOST_C, MOST_WIDTH_C

_SIGNS = str.maketrans(
    {
        **dict.fromkeys("\N{MINUS SIGN}\N{EN DASH}\N{EM DASH}\N{NON-BREAKING HYPHEN}", "-"),
        **dict.fromkeys("\N{MASCULINE ORDINAL INDICATOR}\N{SUPERSCRIPT ZERO}", "°"),
        "\N{WAVE DASH}": "~",
        "\N{RIGHT SINGLE QUOTATION MARK}": "'",
    }
)
_MINUS = r"-|(?:minus|negative|moins|menos|meno|минус)\s+|零下|氷点下|マイナス|영하"
_BELOW = (  # zero, behind the number; Russian counts degrees of frost
    r"(?:below|under)\s(?:zero|0|freezing(?:\spoint)?)|unter\s(?:null|0|dem\sgefrierpunkt)"
    r"|bajo\scero|sous\széro|sotto\s(?:lo\s)?zero|abaixo\sde\szero|ниже\sнуля|мороза|minus"
)
_DEGREE = r"°|degrees?|deg\b\.?|grad|grados?|gradi|graus?|degrés?|градус(?:а|ов)?|度|도"
_BEFORE = r"摄氏|攝氏|摂氏|섭씨"  # stands before the number, alone or with its minus
_CELSIUS = (
    r"celsius|centigrade|centígrados|[cс](?![a-zа-я])|(?:по\s)?цельси[яю]|摄氏度|攝氏度|摂氏度"
)


def _number(name: str) -> str:
    return (
        rf"(?P<{name}_before>{_BEFORE})?\s*(?P<{name}_minus>{_MINUS})?\s*"
        rf"(?:{_BEFORE}|(?P<{name}_plus>plus\s|\+))?"
        rf"(?P<{name}>\d{{1,3}}(?:[.,]\d{{1,2}})?)(?!\d)"
    )


def _unit(name: str) -> str:
    return rf"\s*(?:{_DEGREE})?\s*(?P<{name}>{_CELSIUS})?\s*"


_TO = r"-|~|\.\.\.?|to|bis|à|a|до|到|至|から|에서"
_AND = r"and|und|y|et|e|и"
_VALUE = (
    rf"(?:(?:(?P<between>between|zwischen|entre|tra|fra|между)|from|von|de|da|от)\s)?"
    rf"{_number('low')}{_unit('low_c')}(?P<low_below>{_BELOW})?"
    rf"(?:\s*\(?(?:±|\+/-|\+-|plus\sor\sminus)\s*(?P<by>\d{{1,2}}(?:[.,]\d)?){_unit('by_c')}\)?"
    rf"|\s*(?P<to>{_TO}|(?(between)(?:{_AND})|-))\s*{_number('high')})?"
    rf"{_unit('high_c')}(?P<below>{_BELOW})?"
)
_FAHRENHEIT = r"(?P<{}>-?[\d.]+)(?:\s*(?:-|to)\s*[\d.]+)?\s*(?:°|degrees?)?\s*f(?:ahrenheit)?"
_SCENE = (
    r"(?:air|picture|image|photo(?:graph)?|scene|room|place|environment|area|location|kitchen"
    r"|shade|street|setting|space)"
)
_PLACE = rf"(?:here|(?:in|out)(?:side|doors)|(?:shown\s)?(?:in|of|at|for)\s(?:this|the)\s{_SCENE})"
_SEEN = (
    r"(?:an?|the|this|their|people's|visible|heavy|warm|hot|cool|cold|winter|summer|bright|of|and|day"
    r"|sunny|cloudy|(?:in|out)door|room|scene|picture|image|photo|clothing|clothes|coats?|jackets?|ice"
    r"|snow|season|light(?:ing)?|sun(?:light|shine)?|plants?|trees|vegetation|weather|surroundings"
    r"|environment|setting|context|visual|cues?)"
)
_SUBJECT = (
    r"(?:(?:the|my|an?)\s)?(?:(?:best|rough|final|estimated|approximate|likely|current|ambient|air"
    r"|outdoor|indoor|outside|inside|room)\s)*(?:temperature|temp\.?|answer|estimate|guess|t(?=\s?[:=≈~]))"
    rf"(?:\s{_PLACE}){{0,2}}"
)
_IS = r"(?:\sis|'s|\s(?:seem|appear|look)s)(?:\s(?:most|likely|probably|estimated|to|be|like|at))*"
_FRAMES = (  # what stands before the value, in each language whose units are read
    rf"(?:(?:(?:based\son|judging\s(?:by|from)|given|considering)(?:\s{_SEEN})+"
    rf"|(?:from|in)\s(?:the|this)\s{_SCENE}),\s)?"
    rf"(?:i(?:'d|\swould)?\s(?:estimate|guess|say|think|believe|assume|expect)(?:\sthat)?\s?)?"
    rf"(?:(?:it|(?:the|this)\s{_SCENE})\s(?:looks|seems|appears)\s(?:like|as\sif)\s"
    rf"(?:{_SEEN}\s)*(?:{_SEEN},\sso\s)?)?"
    rf"(?:(?:it|the\s(?:air|room)){_IS}|{_SUBJECT}(?:{_IS}|\s(?:w|c|sh)ould\sbe|\sto\sbe|\sat|\sof)?)?",
    r"(?:degrees\s|°)?c(?:elsius)?",
    r"(?:ich\s(?:schätze|würde)(?:,\sdass)?\s)?(?:die\s)?(?:geschätzte\s)?(?:luft|umgebungs|raum|innen"
    r"|außen)?temperatur(?:\s(?:hier|im\s(?:bild|raum|zimmer)))?\s?(?:beträgt|ist|auf"
    r"|liegt(?:\sschätzungsweise|\swahrscheinlich)?\sbei)?|es\s(?:sind|ist|hat)|hier\s(?:sind|ist)\ses|ich\sschätze",
    r"(?:(?:estimo|creo|diría|stimo|credo|direi|acho|diria)\s(?:que|che)\s)?(?:l?a\s)?temperatura"
    r"(?:\s(?:ambiente|aquí|estimada|aproximada|stimata|d[oe]l?\s(?:ar|aire|ambiente)|dell'aria"
    r"|(?:(?:en|de)\s(?:la|esta)|[dn]a|[dn]ella)\s(?:imagen|escena|habitación|scena|stanza|cena|imagem|sala)))*"
    r"(?:\s(?:es|é|è|parece\sser|sembra\sessere|ser[íi]a|sarebbe)(?:\sd[ei])?)?"
    r"|(?:hace|hay|ci\ssono|fa)(?=.*grad)|(?:creo|diría)\sque\shace|está|estão|faz",
    r"(?:j'estime\s(?:que\s)?)?(?:la\s)?température(?:\s(?:ambiante|extérieure|estimée|ici|de\sl'air"
    r"|(?:de|dans)\s(?:la|cette|l')\s?(?:pièce|scène|image)))*(?:\sà|\s(?:est|semble\sêtre|serait)"
    r"(?:\sestimée)?(?:\s(?:de|à))?)?(?:\sd')?|il\sfait|je\sdirais|j'estime\sà",
    r"температура(?:\s(?:воздуха|здесь|в\s(?:помещении|комнате)|на\s(?:улице|изображении|фото)))*"
    r"(?:\s(?:составляет|-))?|на\sулице|в\sкомнате",
    r"(?:(?:根据|从)(?:这张)?(?:图片|图像|照片)(?:来看|判断)?,?\s?)?(?:我?(?:估计|认为|觉得))?"
    r"(?:这里|此处|当前|现在|(?:这张)?(?:图|图片|照片|场景|房间)中|(?:这个|该|此)(?:场景|房间|环境|地方))?的?"
    r"(?:空气|环境|室内|室外)?(?:气温|温度|室温|答案)(?:应该)?(?:大约|大概|可能|约)?[是为在]?|(?:我(?:估计|觉得))?[這这]里是?",
    r"(?:(?:ここ|この(?:場所|部屋|画像)|現在|部屋|画像)の)?(?:気温|室温|温度|答え)は?",
    r"(?:이곳의|여기|현재|(?:이\s)?방의)?\s?(?:기온|온도|실내\s온도)[은는]?",
)
_ABOUT = (
    r"(?:about|around|approx(?:imately|\.)?|roughly|circa|ca\.?|probably|likely|perhaps|maybe|near"
    r"|close\sto|a|comfortable|etwa|ungefähr|rund|wahrscheinlich|vermutlich|unos|aproximadamente"
    r"|alrededor\sde|cerca\sde|probablemente|environ|à\speu\sprès|autour\sde|probablement"
    r"|probabilmente|intorno\sai|uns|por\svolta\sde|около|примерно|大[约約概]|[约約]|可能|およそ|おそらく"
    r"|だいたい|약|대략|아마|~|≈)"
)
_AFTER = (
    rf"(?:\s*(?:{_PLACE}|or\sso|schätzen|左右|上下|之间|(?:くらい|ぐらい|程度)?(?:です|でしょう"
    r"|だ?と(?:思|推定さ|考えら)わ?れます)?|(?:정도|쯤)?(?:입니다|이에요|예요)?))?"
)
_ANSWER = re.compile(
    rf"(?:(?:{'|'.join(_FRAMES)})\s*[:=]?\s*)?(?:{_ABOUT},?\s*)*"
    rf"(?:{_FAHRENHEIT.format('f')}\s*[(/=]\s*)?{_VALUE}"
    rf"(?:\s*[(/=,]\s*(?:about\s|or\s)?{_FAHRENHEIT.format('g')}\s*)?\)?{_AFTER}[.!。]?"
)
_TEMPERATURE_KEY = re.compile(
    r"(?:(?:air|ambient|estimated|room)_?)*(?:temp(?:erature)?|celsius|degrees|answer|value)"
    r"(?:_?(?:in_?)?(?:c|celsius|degrees_?c(?:elsius)?))?"
)
_QUOTES = " \t\r\n\"'[]()「」“”"
CLOSE_C = 2.0  # degC by which degrees Fahrenheit beside a value may differ from it
MOST_CHARS = 400  # of an answer that is matched; a longer one fits no frame


@dataclass(frozen=True, slots=True)
class Stated:
    """The range that an answer states, degC; both ends are equal for a single number.

    has_unit: degrees Celsius were written, so that the number before them is whole.
    """

    low_c: float
    high_c: float
    has_unit: bool

    @property
    def value_c(self) -> float:
        """The middle of the range."""
        return (self.low_c + self.high_c) / 2


def read_celsius(text: str) -> Stated:
    """Read the one temperature that an answer is. Raises UnreadError if it is anything else."""
    plain = unicodedata.normalize("NFKC", _of_object(unmarked(text)).translate(_SIGNS))
    plain = " ".join(plain.lower().strip(_QUOTES).split())
    match = _ANSWER.fullmatch(plain) if len(plain) <= MOST_CHARS else None
    stated = None if match is None else _stated(match)
    excerpt = " ".join(text.split())[:80]
    if stated is None:
        raise UnreadError(f"the model's answer is not one temperature alone: `{excerpt}`")
    if not LEAST_C <= stated.low_c <= stated.high_c <= MOST_C:
        raise UnreadError(f"the model's answer is outside {LEAST_C} to {MOST_C} degC: `{excerpt}`")
    return stated


def _stated(match: re.Match[str]) -> Stated | None:
    """Return what a matched answer states; None if it can be understood in two ways."""
    part = match.groupdict()
    low = high = _value(part["low"], part["low_minus"] or part["low_below"] or part["below"])
    if part["high"]:
        high = _value(part["high"], part["high_minus"] or part["below"])
        # In "-10-15" and "minus 5 to 10" the second number may or may not share the minus.
        is_shared = part["to"] == "-" or part["low_minus"] not in {None, "-"}
        if low < 0 < high and is_shared and not part["high_plus"]:
            return None
    low, high = sorted((low, high))
    conversion = part["f"] or part["g"]
    if conversion and abs((_value(conversion, None) - 32) / 1.8 - low) > CLOSE_C:
        return None
    by = _value(part["by"] or "0", None)
    has_unit = any(part[name] for name in ("low_before", "low_c", "by_c", "high_c"))
    return Stated(low - by, high + by, has_unit) if high - low <= MOST_WIDTH_C else None


def _value(number: str, minus: str | None) -> float:
    value = float(number.replace(",", "."))
    return -value if minus and value else value


def _of_object(text: str) -> str:
    """Return the temperature and unit of an answer that is a JSON object; any other text as is."""
    try:
        fields = {str(name).lower(): str(value) for name, value in json.loads(text).items()}
    except (ValueError, RecursionError, AttributeError):
        return text
    values = [value for name, value in fields.items() if _TEMPERATURE_KEY.fullmatch(name)]
    return " ".join([*values, *(value for name, value in fields.items() if "unit" in name)])
