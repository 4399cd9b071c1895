"""Writes firmware to a board with avrdude.

It asks the board for its firmware version, writes, and asks again: success is decided by the
board's own answer, not by avrdude's. Knows boot loaders and versions, but not the plate's protocol.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from hapticvlm import documents
from hapticvlm.commands.progress import working
from hapticvlm.devices import plate
from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import ports
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.ports import PortInfo
from hapticvlm.devices.plate.protocol import FOR_ONE_RESISTOR
from hapticvlm.errors import HapticVLMError, UsageError

SHIPPED = Path(plate.__file__).parent / "firmware" / "plate.hex"
ONE_RESISTOR = SHIPPED.with_name("one-resistor.hex")
# ATmega328P behind optiboot, as on an Uno and a Nano with the new boot loader.
AVRDUDE = ("-p", "m328p", "-c", "arduino", "-b", "115200", "-D")
FLASH_BYTES = 32 * 1024 - 512  # the boot loader keeps the rest
SLOWEST_S = 120.0
NO_AVRDUDE = (
    "avrdude is not installed. Windows: winget install AVRDudes.AVRDUDE; macOS: brew install "
    "avrdude; Debian, Ubuntu: sudo apt install avrdude. Then open a new terminal"
)
FAILED = (
    "is it an Uno, or a Nano with the new boot loader (optiboot)? For other boards see "
    "firmware/README.md"
)
CHIP_328PB = (
    "this board has an ATmega328PB; the firmware is for an ATmega328P and was not tried on it. To "
    "write it anyway, run avrdude yourself with -p m328pb"
)
PERMISSION = "run hapticvlm doctor: it names the group that may open the port"
BUSY = "close the other program that has the port open, perhaps `hapticvlm serve`"

# Words of the line that names the cause, the most telling first: of avrdude 6 and of 7.
_CAUSES = ("signature for", "can't open", "cannot open", "not responding", "verif", "error")
_NO_CAUSE = re.compile(r"^(Reading|Writing) \||^avrdude done|^Double check chip")  # and progress


class FlashError(HapticVLMError):
    """Raised when nothing was written, or the board does not run what was written."""


@dataclass(frozen=True, slots=True)
class Image:
    """A program for the board; its version is None where it is not known."""

    path: Path
    version: str | None
    size: int

    @property
    def text(self) -> str:
        """A description for a person: name, size and hash."""
        name = self.path.name if self.version is None else f"firmware {self.version}"
        digest = hashlib.sha256(documents.read_bytes(self.path)).hexdigest()[:12]
        return f"{name} ({self.size} bytes, sha256 {digest}...)"


def flash(
    address: str, path: Path | None, *, one_resistor: bool = False, dry_run: bool = False
) -> int:
    """Write an image (by default the shipped one) to the board at a port or at `auto`.

    The shipped one for the plate of one resistor is written where it is asked for, and to a board
    that has it. With `dry_run` nothing is written, and avrdude is not needed. Raises FlashError,
    DeviceError and UsageError, each in one line.
    """
    own = None if path is None else read(path)
    avrdude = shutil.which("avrdude")
    if avrdude is None and not dry_run:
        raise FlashError(NO_AVRDUDE)
    with working("asking the board for its version"):
        place, before = _board(address)
    image = own or shipped(one_resistor=one_resistor or FOR_ONE_RESISTOR in before)
    print(f"{place.text}: {before}")
    if avrdude is None or dry_run:
        print(f"would write {image.text}; nothing was written")
        return 0
    print(f"writing {image.text}", flush=True)
    with working("writing"):
        _run(avrdude, place, image)
    with working("asking the board for its version"):
        written = _firmware(place)
    if written is None:
        raise FlashError(f"{image.path.name} was written, but the board does not answer as a plate")
    if image.version is not None and written.partition(" (")[0] != image.version:
        raise FlashError(f"avrdude wrote {image.version}, but the board still runs {written}")
    print(f"done: the board answers with firmware {written}")
    return 0


def shipped(*, one_resistor: bool = False) -> Image:
    """Return the image that ships with this program."""
    facts = json.loads(SHIPPED.with_suffix(".json").read_text(encoding="utf-8"))
    path = ONE_RESISTOR if one_resistor else SHIPPED
    version = facts["firmware"] + FOR_ONE_RESISTOR * one_resistor
    return Image(path, version, program_bytes(path.read_text(encoding="ascii")))


def read(path: Path) -> Image:
    """Return a user's image. Raises UsageError for a file that is not a program of this chip."""
    try:
        size = program_bytes(documents.read_bytes(path, documents.MIB).decode("ascii"))
    except ValueError as error:  # not ASCII among them
        raise UsageError(
            f"{path} is not an Intel HEX file for an ATmega328P: {documents.reason(error)}"
        ) from None
    return Image(path, None, size)


def program_bytes(text: str) -> int:
    """Count the bytes of an Intel HEX file. Raises ValueError for a damaged or too large one."""
    size = 0
    is_ended = False
    for number, line in enumerate(text.split(), start=1):
        record = bytes.fromhex(line[1:]) if line.startswith(":") else b""
        if len(record) < 5 or record[0] != len(record) - 5 or sum(record) % 256:
            raise ValueError(f"line {number} is damaged")
        kind = record[3]
        start = int.from_bytes(record[1:3], "big")
        if kind == 0 and start + record[0] > FLASH_BYTES:
            raise ValueError(f"line {number} is beyond the {FLASH_BYTES} bytes of its flash")
        size += record[0] if kind == 0 else 0
        is_ended = kind == 1
    if not is_ended or not size:
        raise ValueError("the end is missing")
    return size


def _board(address: str) -> tuple[PortInfo, str]:
    """Return the board's port and its present firmware, in words."""
    try:
        candidates = ports.candidate_ports(address)
    except ports.UnknownPortsError as error:
        raise FlashError(str(error).replace("--peltier", "--port")) from None
    first = candidates[0]
    if address != ports.AUTO:
        _open_once(first)  # otherwise a silent board and a missing port look alike
        return first, _describe(_firmware(first))
    answering = [
        (place, firmware) for place in candidates if (firmware := _firmware(place)) is not None
    ]
    if len(answering) == 1:
        place, firmware = answering[0]
        return place, _describe(firmware)
    names = ", ".join(place.text for place in candidates)
    if answering:
        raise FlashError(f"several plates answer; choose one of {names}: --port PORT")
    raise FlashError(
        f"no plate answers at {names}; for a new board give its port: --port {first.url}. "
        "The program on it will be overwritten"
    )


def _open_once(place: PortInfo) -> None:
    try:
        ports.open_port(place.url).close()
    except DeviceError as error:
        raise DeviceError(f"{place.text} {error}") from None


def _describe(firmware: str | None) -> str:
    return "does not answer as a plate yet" if firmware is None else f"firmware {firmware} now"


def _firmware(place: PortInfo) -> str | None:
    """Return the board's firmware version; None without an answer. No setpoint is sent."""
    plate = Peltier(place.url)
    try:
        plate.connect()
    except DeviceError:
        return None
    finally:
        plate.close()
    return plate.firmware


def _run(avrdude: str, place: PortInfo, image: Image) -> None:
    command = [avrdude, *AVRDUDE, "-P", place.url, "-U", f"flash:w:{image.path}:i"]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", timeout=SLOWEST_S
        )
    except subprocess.TimeoutExpired:
        raise FlashError(f"avrdude did not end within {SLOWEST_S:g} s; {FAILED}") from None
    if done.returncode:
        words = done.stdout + done.stderr
        raise FlashError(f"avrdude: {_reason(words)}; {_advice(words.lower())}")


def _reason(text: str) -> str:
    """Return the line of avrdude's output that names the cause, without its prefix.

    Where no line has words that are known, it is the last one that is not a progress bar.
    """
    stripped = (line.strip() for line in text.splitlines())
    lines = [line for line in stripped if line and not _NO_CAUSE.search(line)]
    known = [line for word in _CAUSES for line in lines if word in line.lower()]
    if not lines:
        return "it failed and did not say why"
    return re.sub(r"^avrdude(?: OS)?(?: error)?: ", "", (known or lines[-1:])[0])


def _advice(words: str) -> str:
    """Return what to do, by all that avrdude said in lower case."""
    if "m328pb" in words or "1e9516" in words:
        return CHIP_328PB
    if "permission denied" in words:
        return PERMISSION
    return BUSY if "resource busy" in words else FAILED
