"""Builds each shipped .hex: `python firmware/prebuilt.py`; `--check` builds and compares them.

The package contains them, so that `hapticvlm plate flash` needs no compiler; plate.json beside it
records sources and compiler. A different compiler produces different bytes from the same sources;
then only the sources are compared, and the last line of output says so.
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
DEFINES = {"plate.hex": "", "one-resistor.hex": "-DONE_RESISTOR"}
FACTS = SHIPPED / "plate.json"
VERSION = re.compile(r"FIRMWARE_MAJOR = (\d+), FIRMWARE_MINOR = (\d+), FIRMWARE_PATCH = (\d+)")


def main() -> int:
    """Write all files, or check them; return 1 when they do not match the sources."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    if parser.parse_args().check:
        problems = differences()
        sys.stderr.write("".join(f"{line}\n" for line in problems))
        sys.stdout.write(f"{compared()}\n")
        return int(bool(problems))
    SHIPPED.mkdir(exist_ok=True)
    for name in DEFINES:
        (SHIPPED / name).write_bytes(build(name))
    facts = {
        "firmware": version(),
        "sources_sha256": sources(),
        "hex_sha256": digests(),
        "made_by": compiler(),
    }
    FACTS.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    return 0


def differences() -> list[str]:
    """Return the differences between the shipped files and these sources."""
    facts = json.loads(FACTS.read_text(encoding="utf-8"))
    problems = []
    problems += [
        f"{name} does not have the SHA-256 in plate.json"
        for name, digest in digests().items()
        if digest != facts["hex_sha256"][name]
    ]
    if facts["sources_sha256"] != sources():
        problems.append("the sources have changed: run python firmware/prebuilt.py")
    elif facts["firmware"] != version():
        problems.append("plate.json has a different version from core/protocol.h")
    elif facts["made_by"] == compiler() and any(
        build(name) != (SHIPPED / name).read_bytes() for name in DEFINES
    ):
        problems.append("the same compiler produces different bytes from the same sources")
    return problems


def compared() -> str:
    """Return a line that states whether bytes or only sources were compared."""
    made_by, here = json.loads(FACTS.read_text(encoding="utf-8"))["made_by"], compiler()
    if made_by == here:
        return f"compared byte for byte, {here}"
    return f"compared the sources only: made by {made_by}, here is {here or 'no avr-g++'}"


def digests() -> dict[str, str]:
    """Return the SHA-256 of each shipped program."""
    return {name: hashlib.sha256((SHIPPED / name).read_bytes()).hexdigest() for name in DEFINES}


def build(name: str) -> bytes:
    """Compile a firmware as shipped: board number 0, the limits of its plate."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["make", "-C", str(HERE / "avr"), f"BUILD={folder}", "BOARD_ID=0"]
        command.append(f"DEFINES={DEFINES[name]}")
        subprocess.run(command, check=True, capture_output=True)
        return (Path(folder) / "plate.hex").read_bytes()


def sources() -> str:
    """Return the SHA-256 of all sources, independent of line endings."""
    digest = hashlib.sha256()
    for path in (*sorted((HERE / "core").glob("*")), HERE / "avr/main.cpp", HERE / "avr/Makefile"):
        digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def version() -> str:
    """Return the version that the board reports."""
    match = VERSION.search((HERE / "core" / "protocol.h").read_text(encoding="utf-8"))
    if match is None:
        raise RuntimeError("core/protocol.h states no version")
    return ".".join(match.groups())


def compiler() -> str | None:
    """Return the versions of compiler, assembler and C library; None when they are missing."""
    if any(shutil.which(tool) is None for tool in ("avr-g++", "avr-as", "make")):
        return None
    versions = [_output(tool, "--version").splitlines()[0] for tool in ("avr-g++", "avr-as")]
    macros = _output("avr-g++", "-E", "-dM", "-include", "avr/version.h", "-x", "c++", "-")
    library = re.search(r'__AVR_LIBC_VERSION_STRING__ "(.*)"', macros)
    return ", ".join((*versions, f"avr-libc {library[1] if library else 'unknown'}"))


def _output(*command: str) -> str:
    done = subprocess.run(command, check=True, capture_output=True, text=True, input="")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
