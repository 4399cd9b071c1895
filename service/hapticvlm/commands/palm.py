"""The contact resistance of a palm, as an option's text: a number, or what `calibrate` wrote."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

_MOST_BYTES = 65_536  # a calibration has some three hundred


def contact_resistance(text: str) -> float:
    """Read a contact resistance in m2 K/W, of any range; an argparse type.

    `text` is a number, or the file that `hapticvlm calibrate thermal --out FILE` wrote. Raises
    ArgumentTypeError that says what to give.
    """
    try:
        return float(text)
    except ValueError:
        pass
    told = _told(Path(text))
    value = told.get("contact_resistance")
    if told.get("calibrate") != "thermal" or isinstance(value, bool):
        value = None
    if not isinstance(value, int | float):
        raise _not_a_result(text)
    return float(value)


def _told(path: Path) -> dict[str, object]:
    try:
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        reason = error.strerror or error
        raise argparse.ArgumentTypeError(f"{path}: no number, and as a file: {reason}") from None
    try:
        told = json.loads(data) if len(data) <= _MOST_BYTES else None
    except (ValueError, RecursionError):
        told = None
    if not isinstance(told, dict):
        raise _not_a_result(str(path))
    return told


def _not_a_result(text: str) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(
        f"{text} is not what `hapticvlm calibrate thermal --out FILE` writes"
    )
