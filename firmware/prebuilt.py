"""Makes the .hex that ships: `python firmware/prebuilt.py`; `--check` builds it anew and compares.

It lies in the package, so that `hapticvlm plate flash` needs no compiler. Beside it stands what it
was made of. Another compiler makes other bytes of the same sources; then only the sources are
compared, and the last line says so.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
SHIPPED = HERE.parent / "service" / "hapticvlm" / "devices" / "plate" / "firmware"
HEX, MADE_OF = SHIPPED / "plate.hex", SHIPPED / "plate.json"
VERSION = re.compile(r"FIRMWARE_MAJOR = (\d+), FIRMWARE_MINOR = (\d+), FIRMWARE_PATCH = (\d+)")


def main() -> int:
    """Write both files, or check them; 1 when they are not of these sources."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    if parser.parse_args().check:
        found = differences()
        sys.stderr.write("".join(f"{line}\n" for line in found))
        sys.stdout.write(f"{compared()}\n")
        return int(bool(found))
    SHIPPED.mkdir(exist_ok=True)
    built = build()
    HEX.write_bytes(built)
    facts = {
        "firmware": version(),
        "sources_sha256": sources(),
        "hex_sha256": hashlib.sha256(built).hexdigest(),
        "made_by": compiler(),
    }
    MADE_OF.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    return 0


def differences() -> list[str]:
    """Say in what the shipped files differ from these sources."""
    facts = json.loads(MADE_OF.read_text(encoding="utf-8"))
    found = []
    if facts["hex_sha256"] != hashlib.sha256(HEX.read_bytes()).hexdigest():
        found.append("plate.hex is not the file that plate.json is about")
    if facts["sources_sha256"] != sources():
        found.append("the sources have changed since: run python firmware/prebuilt.py")
    elif facts["firmware"] != version():
        found.append("plate.json names another version than core/protocol.h")
    elif facts["made_by"] == compiler() and build() != HEX.read_bytes():
        found.append("the same compiler makes other bytes of the same sources")
    return found


def compared() -> str:
    """Say whether the bytes could be compared here."""
    made_by, here = json.loads(MADE_OF.read_text(encoding="utf-8"))["made_by"], compiler()
    if made_by == here:
        return f"compared byte for byte, {here}"
    return f"compared the sources only: made by {made_by}, here is {here or 'no avr-g++'}"


def build() -> bytes:
    """Compile the firmware as it is shipped: board number 0, limits as they stand."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["make", "-C", str(HERE / "avr"), f"BUILD={folder}", "BOARD_ID=0", "DEFINES="]
        subprocess.run(command, check=True, capture_output=True)
        return (Path(folder) / "plate.hex").read_bytes()


def sources() -> str:
    """Return the SHA-256 of all that the compiler reads, line endings apart."""
    found = hashlib.sha256()
    for path in (*sorted((HERE / "core").glob("*")), HERE / "avr/main.cpp", HERE / "avr/Makefile"):
        found.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
    return found.hexdigest()


def version() -> str:
    """Return the version that the board will tell."""
    found = VERSION.search((HERE / "core" / "protocol.h").read_text(encoding="utf-8"))
    if found is None:
        raise RuntimeError("core/protocol.h names no version")
    return ".".join(found.groups())


def compiler() -> str | None:
    """Return the versions of compiler, assembler and C library, None without them."""
    if any(shutil.which(tool) is None for tool in ("avr-g++", "avr-as", "make")):
        return None
    said = [_said(tool, "--version").splitlines()[0] for tool in ("avr-g++", "avr-as")]
    macros = _said("avr-g++", "-E", "-dM", "-include", "avr/version.h", "-x", "c++", "-")
    library = re.search(r'__AVR_LIBC_VERSION_STRING__ "(.*)"', macros)
    return ", ".join((*said, f"avr-libc {library[1] if library else 'unknown'}"))


def _said(*command: str) -> str:
    done = subprocess.run(command, check=True, capture_output=True, text=True, input="")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
