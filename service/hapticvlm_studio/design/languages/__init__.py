"""Loads the texts of the study page, one TOML file per language; a study may add its own."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from hapticvlm import documents
from hapticvlm_studio.design.stimuli import StudyError

SHIPPED = Path(__file__).parent
REFERENCE = "en"  # has every text; other languages are compared with it


def texts(language: str, folder: Path) -> dict[str, Any]:
    """Return the page's texts in a language; a file in `folder` overrides the shipped one.

    Raises StudyError when the language is not known or its file lacks a text.
    """
    own = folder / f"{language}.toml"
    shipped = sorted(path.stem for path in SHIPPED.glob("*.toml"))
    if own.exists():
        table = _load(own)
        missing = _keys(_load(SHIPPED / f"{REFERENCE}.toml")) - _keys(table)
        if missing:
            raise StudyError(f"{own}: lacks {', '.join(sorted(missing)[:5])}")
        return table
    if language not in shipped:
        raise StudyError(
            f"no language {language!r}: shipped are {', '.join(shipped)}; to add another, put "
            f"{own.name} into {folder}, a translated copy of {SHIPPED / f'{REFERENCE}.toml'}"
        )
    return _load(SHIPPED / f"{language}.toml")


@cache
def _load(path: Path) -> dict[str, Any]:
    try:
        return documents.read_toml(path, dict[str, Any])
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: {documents.reason(error)}") from None


def _keys(table: Mapping[str, Any], above: str = "") -> set[str]:
    """Return the dotted names of all texts; names of patterns need no translation."""
    keys = set()
    for name, value in table.items():
        if isinstance(value, dict) and name != "names":
            keys |= _keys(value, f"{above}{name}.")
        elif name != "names":
            keys.add(above + name)
    return keys
