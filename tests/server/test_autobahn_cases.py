"""The cases of the Autobahn test suite, by its numbers, against the edge that echoes.

Its fuzzing client needs a Python that is no longer maintained, so its list is written out here,
from what RFC 6455 says of each: chapters 1 to 7, 9 and 10. 12 and 13 are about compression, which
we do not offer. A case is what is sent, in pieces or at once, and what must come back, in order.
"""

import asyncio
import struct
from typing import Any

from edge_service import Service, listening
from pace import PACE
from raw_frames import BINARY, CLOSE, KEY, PING, PONG, TEXT, closing, frame

CHOP = 997

EVERY_ALPHABET = "Hello-µ@ßöäüàá-UTF-8!!".encode()
KOSME = bytes.fromhex("cebae1bdb9cf83cebcceb5")  # 2, 3, 2, 2 and 2 octets
BROKEN = KOSME + b"\xed\xa0\x80edited"  # a surrogate


def split(opcode, *parts):
    """A message in several frames."""
    found = [frame(opcode if at == 0 else 0, part, fin=False) for at, part in enumerate(parts[:-1])]
    return b"".join(found) + frame(0, parts[-1])


def fails(code):
    return [(CLOSE, code)]


NORMAL = closing(1000)
ENDS = [(CLOSE, 1000)]
CASES: dict[str, tuple[Any, ...]] = {}


def case(number, sent, expected, *, chop=None, then=NORMAL):
    """Without a close expected, `then` is sent when all has come: it closes."""
    CASES[number] = sent, expected, chop, then


for chapter, opcode in ((1, TEXT), (2, BINARY)):
    filler = b"*" if opcode == TEXT else b"\xfe"
    for at, size in enumerate((0, 125, 126, 127, 128, 65_535, 65_536, 65_536), 1):
        body = filler * size
        chop = CHOP if at == 8 else None
        case(f"1.{chapter}.{at}", frame(opcode, body), [(opcode, body)], chop=chop)

for number, body in (
    ("2.1", b""),
    ("2.2", b"Hello"),
    ("2.3", b"\x00\xff\xfe"),
    ("2.4", b"*" * 125),
):
    case(number, frame(PING, body), [(PONG, body)])
case("2.5", frame(PING, b"*" * 126), fails(1002))
case("2.6", frame(PING, b"*" * 125), [(PONG, b"*" * 125)], chop=1)
case("2.7", frame(PONG), [])
case("2.8", frame(PONG, b"unasked"), [])
case("2.9", frame(PONG, b"unasked") + frame(PING, b"p"), [(PONG, b"p")])
TEN = b"".join(frame(PING, b"%d" % at) for at in range(10))
for number, chop in (("2.10", None), ("2.11", 1)):
    case(number, TEN, [*((PONG, b"%d" % at) for at in range(10))], chop=chop)

for number, reserved, chop in (("3.1", 1, None), ("3.2", 2, None), ("3.3", 3, None), ("3.4", 4, 1)):
    before = b"" if number == "3.1" else frame(TEXT, b"before")
    first = [] if number == "3.1" else [(TEXT, b"before")]
    case(number, before + frame(TEXT, b"x", reserved=reserved), [*first, *fails(1002)], chop=chop)
case("3.5", frame(BINARY, b"\x00\xff", reserved=5), fails(1002))
case("3.6", frame(PING, b"x", reserved=6), fails(1002))
case("3.7", frame(CLOSE, reserved=7), fails(1002))

for chapter, codes in ((1, range(3, 8)), (2, range(11, 16))):
    for at, opcode in enumerate(codes, 1):
        before = frame(TEXT, b"before") if at > 2 else b""
        first = [(TEXT, b"before")] if at > 2 else []
        case(f"4.{chapter}.{at}", before + frame(opcode, b"x"), [*first, *fails(1002)])

case("5.1", frame(PING, b"a", fin=False) + frame(0, b"b"), fails(1002))
case("5.2", frame(PONG, b"a", fin=False) + frame(0, b"b"), fails(1002))
for number, chop in (("5.3", None), ("5.4", 7), ("5.5", 1)):
    case(number, split(TEXT, b"one", b"two"), [(TEXT, b"onetwo")], chop=chop)
BETWEEN = frame(TEXT, b"one", fin=False) + frame(PING, b"p") + frame(0, b"two")
for number, chop in (("5.6", None), ("5.7", 7), ("5.8", 1)):
    case(number, BETWEEN, [(PONG, b"p"), (TEXT, b"onetwo")], chop=chop)
for number, fin, chop in (
    ("5.9", True, None),
    ("5.10", True, 7),
    ("5.11", True, 1),
    ("5.12", False, None),
    ("5.13", False, 7),
    ("5.14", False, 1),
):
    case(number, frame(0, b"nothing before", fin=fin) + frame(TEXT, b"x"), fails(1002), chop=chop)
case(
    "5.15",
    split(TEXT, b"one", b"two") + frame(0, b"x", fin=False) + frame(TEXT, b"y"),
    [(TEXT, b"onetwo"), *fails(1002)],
)
for number, fin in (("5.16", False), ("5.17", True)):
    twice = frame(0, b"x", fin=fin) + frame(TEXT, b"a", fin=False) + frame(0, b"b")
    case(number, twice * 2, fails(1002))
case("5.18", frame(TEXT, b"one", fin=False) + frame(TEXT, b"two"), fails(1002))
FIVE = (
    frame(TEXT, b"1", fin=False)
    + frame(0, b"2", fin=False)
    + frame(PING, b"p")
    + frame(0, b"3", fin=False)
    + frame(0, b"4", fin=False)
    + frame(PING, b"q")
    + frame(0, b"5")
)
for number, chop in (("5.19", None), ("5.20", 1)):
    answers = [(PONG, b"p"), (PONG, b"q"), (TEXT, b"12345")]
    case(number, FIVE, answers, chop=chop)

case("6.1.1", frame(TEXT), [(TEXT, b"")])
case("6.1.2", split(TEXT, b"", b"", b""), [(TEXT, b"")])
case("6.1.3", split(TEXT, b"", b"middle", b""), [(TEXT, b"middle")])
case("6.2.1", frame(TEXT, EVERY_ALPHABET), [(TEXT, EVERY_ALPHABET)])
halves = EVERY_ALPHABET[:7], EVERY_ALPHABET[7:]  # cut inside a letter
case("6.2.2", split(TEXT, *halves), [(TEXT, EVERY_ALPHABET)])
octets = [EVERY_ALPHABET[at : at + 1] for at in range(len(EVERY_ALPHABET))]
case("6.2.3", split(TEXT, *octets), [(TEXT, EVERY_ALPHABET)])
case("6.2.4", split(TEXT, *[bytes([one]) for one in KOSME]), [(TEXT, KOSME)])
case("6.3.1", frame(TEXT, BROKEN), fails(1007))
case("6.3.2", split(TEXT, *[bytes([one]) for one in BROKEN]), fails(1007))
# Seen with the frame that breaks it: the message is not even complete.
case("6.4.1", frame(TEXT, KOSME, fin=False) + frame(0, b"\xf4\x90\x80\x80", fin=False), fails(1007))
case("6.4.2", frame(TEXT, KOSME + b"\xf4", fin=False) + frame(0, b"\x90", fin=False), fails(1007))

VALID = {
    "6.5": [KOSME[:end].decode() for end in (2, 5, 7, 9, 11)],
    "6.7": ["\x00", "\x80", "ࠀ", "\U00010000"],
    "6.9": ["\x7f", "\u07ff", "\uffff", "\U0010ffff"],
    "6.11": ["\ud7ff", "\ue000", "\ufffd", "\U0010ffff"],
    "6.22": [f"{chr(plane << 16 | 0xFFFE)}{chr(plane << 16 | 0xFFFF)}" for plane in range(17)],
    "6.23": ["\ufff9", "\ufffa", "\ufffb", "\ufffc", "\ufffd"],
}
for number, words in VALID.items():
    for at, word in enumerate(words, 1):
        case(f"{number}.{at}", frame(TEXT, word.encode()), [(TEXT, word.encode())])
INVALID = {
    "6.6": [KOSME[:end] for end in (1, 3, 4, 6, 8, 10)],
    "6.8": [b"\xf8\x88\x80\x80\x80", b"\xfc\x84\x80\x80\x80\x80"],  # five and six octets
    "6.10": [b"\xf7\xbf\xbf\xbf", b"\xfb\xbf\xbf\xbf\xbf", b"\xfd\xbf\xbf\xbf\xbf\xbf"],
    "6.12": [b"\x80", b"\xbf", b"\x80\xbf", b"\x80\xbf\x80", bytes(range(0x80, 0xC0))],
    "6.13": [b"\xc0 \xc1 \xdf ", b"\xe0 \xef ", b"\xf0 \xf7 ", b"\xf8 \xfb ", b"\xfc \xfd "],
    "6.14": [b"\xc0", b"\xe0\x80", b"\xf0\x80\x80", b"\xf8\x80\x80\x80", b"\xdf", b"\xef\xbf"],
    "6.15": [b"\xc0\xe0\x80\xf0\x80\x80\xf8\x80\x80\x80"],
    "6.16": [b"\xfe", b"\xff", b"\xfe\xfe\xff\xff"],
    "6.17": [b"\xc0\xaf", b"\xe0\x80\xaf", b"\xf0\x80\x80\xaf"],  # overlong
    "6.18": [b"\xc1\xbf", b"\xe0\x9f\xbf", b"\xf0\x8f\xbf\xbf"],
    "6.19": [b"\xc0\x80", b"\xe0\x80\x80", b"\xf0\x80\x80\x80"],
    "6.20": [b"\xed\xa0\x80", b"\xed\xad\xbf", b"\xed\xae\x80", b"\xed\xbf\xbf"],  # surrogates
    "6.21": [b"\xed\xa0\x80\xed\xb0\x80", b"\xed\xaf\xbf\xed\xbf\xbf"],
}
for number, broken in INVALID.items():
    for at, body in enumerate(broken, 1):
        case(f"{number}.{at}", frame(TEXT, body), fails(1007))

LONG = b"*" * 256 * 1024
HASTY = ("7.1.1",)
case("7.1.1", frame(TEXT, b"hello") + NORMAL, [(TEXT, b"hello"), *ENDS])
case("7.1.2", NORMAL + NORMAL, ENDS)
case("7.1.3", NORMAL + frame(PING, b"late"), ENDS)
case("7.1.4", NORMAL + frame(TEXT, b"late"), ENDS)
case("7.1.5", frame(TEXT, b"one", fin=False) + NORMAL + frame(0, b"two"), fails(1002))
case("7.1.6", frame(PING, b"first"), [(PONG, b"first")], then=NORMAL + frame(PING, b"late"))
case("7.3.1", closing(), [(CLOSE, None)])
case("7.3.2", frame(CLOSE, b"x"), fails(1002))
case("7.3.3", closing(1000), ENDS)
case("7.3.4", closing(1000, b"Hello World!"), ENDS)
case("7.3.5", closing(1000, b"*" * 123), ENDS)
case("7.3.6", closing(1000, b"*" * 124), fails(1002))
case("7.5.1", closing(1000, BROKEN), fails(1007))
GOOD = (1000, 1001, 1002, 1003, 1007, 1008, 1009, 1010, 1011, 3000, 3999, 4000, 4999)
for at, code in enumerate(GOOD, 1):
    case(f"7.7.{at}", closing(code), [(CLOSE, code)])
for at, code in enumerate((0, 999, 1004, 1005, 1006, 1016, 1100, 2000, 2999), 1):
    case(f"7.9.{at}", closing(code), fails(1002))
for at, code in enumerate((5000, 65_535), 1):
    case(f"7.13.{at}", closing(code), fails(1002))

MIB = 1024 * 1024
for chapter, opcode in ((1, TEXT), (2, BINARY)):
    for at, size in enumerate((65_536, 262_144, MIB), 1):
        body = b"*" * size
        case(f"9.{chapter}.{at}", frame(opcode, body), [(opcode, body)])
for chapter, opcode in ((3, TEXT), (4, BINARY)):
    for at, size in enumerate((1024, 16_384, 65_536), 1):
        parts = [b"*" * size] * (262_144 // size)
        case(f"9.{chapter}.{at}", split(opcode, *parts), [(opcode, LONG)])
for chapter, opcode in ((5, TEXT), (6, BINARY)):
    for at, chop in enumerate((256, 512, 1024, 2048), 1):
        body = b"*" * 262_144
        case(f"9.{chapter}.{at}", frame(opcode, body), [(opcode, body)], chop=chop)
for chapter, opcode in ((7, TEXT), (8, BINARY)):
    for at, size in enumerate((0, 16, 64, 256, 1024), 1):
        sent = frame(opcode, b"*" * size) * 50
        case(f"9.{chapter}.{at}", sent, [(opcode, b"*" * size)] * 50)
case("10.1.1", split(TEXT, *[b"*" * 1300] * 50), [(TEXT, b"*" * 65_000)])


async def next_frame(reader):
    """Read a frame: its opcode and payload, of a close the code; None where the stream ends."""
    head = await reader.read(1)
    if not head:
        return None
    assert head[0] & 0xF0 == 0x80, "whole frames, no reserved bit"
    size = (await reader.readexactly(1))[0]
    if size > 125:
        size = int.from_bytes(await reader.readexactly(2 if size == 126 else 8), "big")
    payload = await reader.readexactly(size)
    opcode = head[0] & 0x0F
    if opcode == CLOSE:
        return CLOSE, struct.unpack(">H", payload[:2])[0] if payload else None
    return opcode, payload


async def exchange(reader, writer, sent, chop, count):
    """Send in pieces while reading up to `count` frames, fewer where the stream ends."""

    async def send():
        for start in range(0, len(sent), chop or len(sent) or 1):
            writer.write(sent[start : start + (chop or len(sent))])
            await asyncio.sleep(0)
            await writer.drain()

    sending = asyncio.create_task(send())
    found: list[Any] = []
    while len(found) < count and (frame := await next_frame(reader)) is not None:
        found.append(frame)
    await sending
    return found


async def test_each_case_is_answered_as_the_standard_says():
    offenders = []
    for number in CASES:
        try:
            await answer_to(number)
        except (AssertionError, TimeoutError) as error:
            offenders.append(f"{number}: {error!r}")
    assert offenders == []


async def answer_to(number):
    """Send a case and compare what comes back."""
    sent, expected, chop, then = CASES[number]
    service = Service(lambda data: data)
    async with asyncio.timeout(20.0 * PACE), listening(service) as port:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(KEY)
        await reader.readuntil(b"\r\n\r\n")
        found = await exchange(reader, writer, sent, chop, len(expected))
        if all(opcode != CLOSE for opcode, _ in expected):
            found += await exchange(reader, writer, then, None, 1)
            expected = expected + ENDS
        found += await exchange(reader, writer, b"", None, 1)  # nothing more, the stream ends
        writer.close()
    messages, controls = by_kind(expected)
    answered, answered_controls = by_kind(found)
    assert [each if isinstance(each, bytes) else each.encode() for each in service.said] == [
        payload for _, payload in messages
    ]
    assert answered_controls == controls
    if controls[-1:] == ENDS and number not in HASTY:
        assert answered == messages
    # Who breaks the rules, or closes, in the same breath is carried out, but told no more.


def by_kind(found):
    """Messages in their order, control frames in theirs: a pong may overtake a message."""
    return [each for each in found if each[0] in (TEXT, BINARY)], [
        each for each in found if each[0] not in (TEXT, BINARY)
    ]


def test_the_list_is_whole():
    assert len(CASES) > 200
