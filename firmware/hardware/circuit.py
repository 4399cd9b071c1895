"""Draws the circuit of parts.py as circuit.svg and lists it in wiring.md: `python circuit.py`.

The plate of one resistor is listed in one-resistor.md.

Sheets side by side; wires end in the name of their net, so that no line crosses another.
`--check` writes nothing and exits with 1 when a file is not current.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from parts import BY_NAME, KIT_STEPS, ON_KIT, ONE_RESISTOR, PARTS, SINK_EUR, Part, price_eur

HERE = Path(__file__).parent
WIDTH, HEIGHT, STEP = 1240, 1022, 42
# Title, left edge, top edge, parts from top to bottom.
SHEETS = (
    ("Board and thermistors", 20, 30, "U1 R1 RT1 C1 R2 RT2 C2 R3 RT3 C3 R4 R5 R6 R24 R26"),
    ("Control voltage", 330, 30, "R7 R8 C4 R11 R9 R10 C5 R12 U2A R25 C7"),
    ("Driver and module", 640, 30, "U3 L1 RS L2 R20 R21 R22 R23 J1 R13 D1 R14 TEC1"),
    ("Cut-out", 950, 30, "J2 F1 R15 RT4 C6 U2B R16 R17 R18 U4A U4B C8 R19 Q1 Q2"),
    ("Cut-out: relay", 330, 610, "K1 D2 D3 S1 S2"),
)
INK = "#1b1f24"


def main() -> int:
    """Write all files, or check them."""
    made = {"circuit.svg": drawing(), "wiring.md": wiring(), "one-resistor.md": one_resistor()}
    if "--check" not in sys.argv[1:]:
        for name, text in made.items():
            (HERE / name).write_text(text, encoding="utf-8")
        return 0
    stale = [n for n, text in made.items() if (HERE / n).read_text(encoding="utf-8") != text]
    if stale:
        sys.stderr.write(f"run python firmware/hardware/circuit.py: {', '.join(stale)}\n")
    return int(bool(stale))


def readable(part: Part) -> str:
    """Return the value as printed beside a symbol."""
    value = part.value
    if isinstance(value, str):
        return value
    if part.name.startswith("J"):
        return f"{value:g} V"
    if part.name.startswith("C"):
        return f"{value * 1e9:g} nF"
    return f"{value / 1e3:g} kohm" if value >= 1e3 else f"{value:g} ohm"


def nets(parts: Iterable[Part]) -> dict[str, list[str]]:
    """Return every net with its pins, as PART.PIN."""
    found: dict[str, list[str]] = {}
    for part in parts:
        for pin, net in part.pins.items():
            found.setdefault(net, []).append(f"{part.name}.{pin}")
    return found


def wiring() -> str:
    """Return the parts and the nets as tables."""
    lines = [
        "# Parts and wiring",
        "",
        "Generated from parts.py by `python firmware/hardware/circuit.py`, which also draws the",
        "[drawing](circuit.svg).",
        "",
        *_priced(PARTS),
        "",
        *_pins(PARTS),
        "",
        "## The driver's kit",
        "",
        "These pins of the chip are wired on the kit alone:",
        "",
        "| pin | |",
        "|---|---|",
        *(f"| {pin} | {what} |" for pin, what in ON_KIT.items()),
        "",
        *(f"{number}. {step}" for number, step in enumerate(KIT_STEPS, 1)),
    ]
    return "\n".join(lines) + "\n"


def one_resistor() -> str:
    """Return parts, prices and nets of the plate of one resistor as tables."""
    lines = [
        "# Parts and wiring of the plate of one resistor",
        "",
        "Generated from parts.py by `python firmware/hardware/circuit.py`.",
        "",
        *_priced(ONE_RESISTOR),
        "",
        *_pins(ONE_RESISTOR),
    ]
    return "\n".join(lines) + "\n"


def _priced(parts: Sequence[Part]) -> list[str]:
    one = parts is ONE_RESISTOR
    eur = [price_eur(part.name, has_one_resistor=one) for part in parts]
    return [
        "Prices are estimates of November 2026; no shop was asked.",
        "",
        "| part | value | | euro |",
        "|---|---|---|---|",
        *(
            f"| {part.name} | {readable(part)} | {part.what} | {price:.2f} |"
            for part, price in zip(parts, eur, strict=True)
        ),
        f"| sink | | 1 to 3 K/W, with a fan | {SINK_EUR:.2f} |",
        f"| {len({part.name.rstrip('AB') for part in parts})} parts and a sink"
        f" | | | {sum(eur) + SINK_EUR:.2f} |",
    ]


def _pins(parts: Iterable[Part]) -> list[str]:
    rows = (f"| {net} | {', '.join(pins)} |" for net, pins in sorted(nets(parts).items()))
    return ["| net | pins |", "|---|---|", *rows]


def drawing() -> str:
    """Return the sheets."""
    body = [part for sheet in SHEETS for part in _sheet(*sheet)]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'font-family="sans-serif" font-size="11" fill="none" stroke="{INK}">'
    )
    return "\n".join(
        (head, '<rect width="100%" height="100%" fill="white" stroke="none"/>', *body, "</svg>\n")
    )


def _sheet(title: str, left: int, top: int, names: str) -> list[str]:
    found = [_text(left, top - 8, title, "bold")]
    y = top
    for name in names.split():
        part = BY_NAME[name]
        is_line = len(part.pins) == 2 and part.name != "J2"
        drawn, used = _two_pins(part, left, y) if is_line else _block(part, left, y)
        found += drawn
        y += used
    return found


def _two_pins(part: Part, left: int, y: int) -> tuple[list[str], int]:
    """Draw a symbol on a line between two named nets."""
    (one, other), middle, at = part.pins.values(), left + 130, y + 26
    found = [
        _line(left + 60, at, middle - 22, at),
        _line(middle + 22, at, left + 200, at),
        *_symbol(part.name, middle, at),
        _text(left + 56, at + 4, one, anchor="end"),
        _text(left + 204, at + 4, other),
        _text(middle, at - 11, f"{part.name} {readable(part)}", "bold", "middle"),
    ]
    if "+" in part.pins:
        found.append(_text(middle - 32 if part.pins["+"] == one else middle + 32, at + 14, "+"))
    return found, STEP


def _symbol(name: str, x: int, y: int) -> list[str]:
    if name[0] == "C":
        return [
            _line(x - 22, y, x - 3, y),
            _line(x + 3, y, x + 22, y),
            _line(x - 3, y - 9, x - 3, y + 9),
            _line(x + 3, y - 9, x + 3, y + 9),
        ]
    if name[0] == "D":
        path = f"M{x - 22} {y}H{x - 8}M{x - 8} {y - 8}V{y + 8}L{x + 8} {y}Z"
        path += f"M{x + 8} {y - 8}V{y + 8}M{x + 8} {y}H{x + 22}"
        return [f'<path d="{path}"/>']
    if name[0] == "L":
        arcs = "a5.5 5.5 0 0 1 11 0" * 4
        return [f'<path d="M{x - 22} {y}{arcs}"/>']
    if name[0] == "S":
        return [
            _line(x - 22, y, x - 14, y),
            _line(x - 14, y, x + 12, y - 9),
            _line(x + 14, y, x + 22, y),
        ]
    found = [f'<rect x="{x - 22}" y="{y - 6}" width="44" height="12"/>']
    if name.startswith("RT"):
        found.append(_line(x - 26, y + 11, x + 18, y - 10))
    return found


def _block(part: Part, left: int, y: int) -> tuple[list[str], int]:
    """Draw a box with its pins on the left, each with the name of its net."""
    height = 14 * len(part.pins) + 8
    found = [
        f'<rect x="{left + 90}" y="{y + 18}" width="80" height="{height}"/>',
        _text(left + 130, y + 14, f"{part.name} {readable(part)}", "bold", "middle"),
    ]
    for row, (pin, net) in enumerate(part.pins.items()):
        at = y + 32 + 14 * row
        found += [
            _line(left + 62, at - 4, left + 90, at - 4),
            _text(left + 58, at, net, anchor="end"),
            _text(left + 95, at, pin),
        ]
    return found, height + 28


def _line(x1: int, y1: int, x2: int, y2: int) -> str:
    return f'<path d="M{x1} {y1}L{x2} {y2}"/>'


def _text(x: int, y: int, text: str, weight: str = "normal", anchor: str = "start") -> str:
    kind = f'font-weight="{weight}" text-anchor="{anchor}" fill="{INK}" stroke="none"'
    return f'<text x="{x}" y="{y}" {kind}>{text}</text>'


if __name__ == "__main__":
    sys.exit(main())
