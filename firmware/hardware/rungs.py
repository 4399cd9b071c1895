"""Draws the wiring of the maker's rungs 1, 2 and 2c as rung*.svg: `python rungs.py`.

Rung 2c shows how the parts of the plate of one resistor join; circuit.py lists them. `--check`
writes nothing and exits with 1 when a file is not current.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
INK, SOFT = "#1b1f24", "#6b7280"
# Distinguishable for colour-blind eyes, and labelled.
HOT, COLD, ON = "#d55e00", "#0072b2", "#009e73"
LEDS = (
    ("D8", ON, "bridge enabled: the plate would be driven"),
    ("D9", HOT, "heat: the brighter, the more current"),
    ("D10", COLD, "cold: the brighter, the more current"),
)
DIVIDERS = (
    ("A0", "plate thermistor 1"),
    ("A1", "plate thermistor 2"),
    ("A2", "sink thermistor"),
    ("A3", "cut-out's thermistor"),
)


def main() -> int:
    """Write both files, or check them."""
    made = {"rung1.svg": rung1(), "rung2.svg": rung2(), "rung2c.svg": rung2c()}
    if "--check" not in sys.argv[1:]:
        for name, text in made.items():
            (HERE / name).write_text(text, encoding="utf-8")
        return 0
    stale = [n for n, text in made.items() if (HERE / n).read_text(encoding="utf-8") != text]
    if stale:
        sys.stderr.write(f"run python firmware/hardware/rungs.py: {', '.join(stale)}\n")
    return int(bool(stale))


def rung1() -> str:
    """Return computer, amplifier, exciter, board and palm."""
    body = [
        _text(20, 30, "Step 1: a sound exciter", "bold", size=15),
        *_box(20, 90, 120, 90, "computer", "audio output"),
        *_box(250, 90, 140, 90, "amplifier", "3 W, 5 V"),
        *_box(250, 240, 140, 50, "USB supply", "5 V, 1 A"),
        _wire(140, 125, 250, 125),
        _text(195, 116, "3.5 mm cable", anchor="middle"),
        _text(195, 142, "left, ground", anchor="middle", ink=SOFT),
        _wire(310, 240, 310, 180),
        _wire(330, 240, 330, 180),
        _text(304, 214, "+5 V", anchor="end"),
        _text(336, 214, "ground"),
        _wire(390, 120, 580, 120),
        _wire(390, 150, 580, 150),
        _text(485, 111, "L+", anchor="middle"),
        _text(485, 167, "L-: to the exciter alone,", anchor="middle"),
        _text(485, 182, "never to ground", anchor="middle"),
        f'<path d="M580 105H620V165H580ZM620 120H645V150H620Z" fill="#eef2f7" stroke="{INK}"/>',
        _text(612, 198, "exciter", "bold", "end"),
        _text(640, 214, "4 or 8 ohm, 3 W", anchor="end"),
        f'<path d="M645 70H660V220H645Z" fill="#e7d3b1" stroke="{INK}"/>',
        _text(652, 58, "thin board", "bold", "middle"),
        _text(652, 246, "about 10 x 15 cm, 3 mm", anchor="middle"),
        _text(652, 261, "plywood or acrylic,", anchor="middle"),
        _text(652, 276, "on four soft feet", anchor="middle"),
        f'<path d="M660 90q38 -6 46 18v54q-8 24 -46 18Z" fill="#f6d9c6" stroke="{INK}"/>',
        _text(714, 130, "palm", "bold"),
        _text(714, 146, "rests on it"),
    ]
    return _svg(800, 310, body)


def rung2() -> str:
    """Return an Uno with eight resistors, three light-emitting diodes and a wire."""
    body = [
        _text(20, 30, "Step 2: the real firmware, no plate", "bold", size=15),
        *_box(330, 60, 150, 400, "", ""),
        _text(392, 80, "Arduino Uno", "bold", "middle"),
        _text(392, 95, "or Nano, optiboot", anchor="middle"),
        _text(405, 222, "USB to the computer", anchor="middle", ink=SOFT),
        *(_text(at, 452, name, "bold", "middle") for at, name in ((360, "5V"), (450, "GND"))),
    ]
    for row, (pin, what) in enumerate(DIVIDERS):
        body += _divider(110 + 92 * row, pin, what)
    body += [
        _text(474, 94, "D6", "bold", "end"),
        _text(474, 124, "D7", "bold", "end"),
        _line("M480 90H520V120H480"),
        _text(530, 102, "a wire instead of the relay: with its"),
        _text(530, 117, "end at D6 moved to GND it is open"),
    ]
    for row, (pin, colour, what) in enumerate(LEDS):
        body += _led(180 + 70 * row, pin, colour, what)
    body += [
        f'<circle cx="405" cy="320" r="7" fill="{HOT}" stroke="none"/>',
        _text(405, 343, "L, on the board", "bold", "middle"),
        _text(405, 357, "steady: driving", anchor="middle"),
        _text(405, 371, "5 blinks a second: fault", anchor="middle"),
        _text(20, 490, "Resistors at A0 to A3: eight of 10 kohm. At D8 to D10: 1 kohm each."),
        _text(
            20,
            507,
            "Two equal resistors are a thermistor at 25 degC. 5V, GND: pins of the board.",
        ),
    ]
    return _svg(760, 525, body)


def rung2c() -> str:
    """Return the parts of the plate of one resistor, and the lines between them."""
    body = [
        _text(20, 30, "Step 2c: the plate of one resistor", "bold", size=15),
        *_box(20, 70, 110, 80, "computer", "USB"),
        *_box(200, 60, 120, 100, "board", "Uno or Nano"),
        *_box(410, 60, 130, 100, "bridge", "DRV8833"),
        *_box(610, 60, 110, 100, "R13", "6.2 ohm"),
        *_box(20, 250, 110, 70, "supply", "5 V, fuse 1.25 A"),
        *_box(410, 250, 130, 70, "cut-out", "relay K1"),
        f'<path d="M610 250H720V274H610Z" fill="{HOT}" stroke="{INK}"/>',
        f'<path d="M610 274H720V330H610Z" fill="#d1d5db" stroke="{INK}"/>',
        f'<path d="M620 250q4 -34 45 -34t45 34Z" fill="#f6d9c6" stroke="{INK}"/>',
        _text(728, 238, "palm", "bold"),
        _text(665, 267, "module", "bold", "middle", ink="white"),
        _text(665, 306, "sink", "bold", "middle"),
        _wire(130, 110, 200, 110),
        _text(165, 101, "USB", anchor="middle"),
        _wire(320, 90, 410, 90),
        _text(365, 81, "D8 enable", anchor="middle"),
        _wire(320, 120, 410, 120),
        _text(365, 137, "D9 heat,", anchor="middle"),
        _text(365, 152, "D10 cool", anchor="middle"),
        _wire(540, 110, 610, 110),
        _line("M720 110H790V262H720"),
        _text(784, 190, "leads", anchor="end"),
        _wire(130, 285, 410, 285),
        _text(232, 302, "supply of the module"),
        _wire(490, 250, 490, 160),
        _text(496, 210, "5 V, switched"),
        _line("M410 265H300V160"),
        _text(306, 202, "D6: leave to hold"),
        _text(306, 218, "D7: relay released"),
        _wire(540, 256, 610, 256),
        _text(565, 247, "RT4", anchor="middle"),
        _line("M610 268H585V360H220V160"),
        _text(
            402, 353, "A0, A1: thermistors of the plate; A2: of the sink; A3: RT4", anchor="middle"
        ),
        _text(20, 392, "The board alone lets the relay hold; its button closes it."),
        _text(20, 409, "Grounds join at one point. Every value and pin is in one-resistor.md."),
    ]
    return _svg(850, 425, body)


def _divider(y: int, pin: str, what: str) -> list[str]:
    """Draw 5V - 10 kohm - pin, and GND - 10 kohm from the same node."""
    found = [_text(180, y - 14, what, ink=SOFT), _dot(200, y), _wire(200, y, 200, y + 36)]
    for name, at, end in (("5V", y, 330), ("GND", y + 36, 200)):
        found += [
            _text(64, at + 4, name, anchor="end"),
            _wire(70, at, 110, at),
            _resistor(110, at),
            _wire(150, at, end, at),
        ]
    return [*found, _text(336, y + 4, pin, "bold")]


def _led(y: int, pin: str, colour: str, what: str) -> list[str]:
    """Draw pin - 1 kohm - diode - GND."""
    symbol = f"M590 {y - 9}V{y + 9}L608 {y}ZM608 {y - 9}V{y + 9}"
    return [
        _wire(480, y, 520, y),
        _resistor(520, y),
        _wire(560, y, 590, y),
        f'<path d="{symbol}" fill="{colour}" stroke="{INK}"/>',
        _wire(608, y, 640, y),
        _text(646, y + 4, "GND"),
        _text(474, y + 4, pin, "bold", "end"),
        _text(500, y - 14, what),
    ]


def _resistor(x: int, y: int) -> str:
    return f'<rect x="{x}" y="{y - 6}" width="40" height="12" fill="white" stroke="{INK}"/>'


def _box(x: int, y: int, width: int, height: int, name: str, what: str) -> list[str]:
    shape = f'x="{x}" y="{y}" width="{width}" height="{height}" rx="6"'
    middle, at = x + width // 2, y + height // 2
    return [
        f'<rect {shape} fill="#eef2f7" stroke="{INK}"/>',
        _text(middle, at - 2, name, "bold", "middle"),
        _text(middle, at + 14, what, anchor="middle"),
    ]


def _wire(x1: int, y1: int, x2: int, y2: int) -> str:
    return f'<path d="M{x1} {y1}L{x2} {y2}" stroke="{INK}"/>'


def _line(path: str) -> str:
    return f'<path d="{path}" stroke="{INK}"/>'


def _dot(x: int, y: int) -> str:
    return f'<circle cx="{x}" cy="{y}" r="3" fill="{INK}" stroke="none"/>'


def _text(
    x: int,
    y: int,
    text: str,
    weight: str = "normal",
    anchor: str = "start",
    *,
    ink: str = INK,
    size: int = 12,
) -> str:
    kind = f'font-weight="{weight}" text-anchor="{anchor}" fill="{ink}" font-size="{size}"'
    return f'<text x="{x}" y="{y}" {kind} stroke="none">{text}</text>'


def _svg(width: int, height: int, body: list[str]) -> str:
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" fill="none">'
    )
    back = '<rect width="100%" height="100%" fill="white" stroke="none"/>'
    return "\n".join((head, back, *body, "</svg>\n"))


if __name__ == "__main__":
    sys.exit(main())
