"""The texts of the study page, a TOML file for each language; a study may bring its own."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from hapticvlm import documents
from hapticvlm_studio.design.stimuli import StudyError

SHIPPED = Path(__file__).parent
REFERENCE = "en"  # has every text


def texts(language: str, folder: Path) -> dict[str, Any]:
    """Return the page's texts in a language; `folder` may hold a file of it. Raises StudyError."""
    own = folder / f"{language}.toml"
    shipped = sorted(path.stem for path in SHIPPED.glob("*.toml"))
    if own.exists():
        found = _load(own)
        missing = _keys(_load(SHIPPED / f"{REFERENCE}.toml")) - _keys(found)
        if missing:
            raise StudyError(f"{own}: lacks {', '.join(sorted(missing)[:5])}")
        return found
    if language not in shipped:
        raise StudyError(
            f"no language {language!r}: shipped are {', '.join(shipped)}; for another, put "
            f"{own.name} into {folder} (a translated copy of {SHIPPED / f'{REFERENCE}.toml'})"
        )
    return _load(SHIPPED / f"{language}.toml")


@cache
def _load(path: Path) -> dict[str, Any]:
    try:
        return documents.parse_toml(documents.read_text(path))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: {error}") from None


def _keys(table: Mapping[str, Any], above: str = "") -> set[str]:
    """Return the dotted names of all texts of the page; names of patterns may stay as they are."""
    found = set()
    for name, value in table.items():
        if isinstance(value, dict) and name != "names":
            found |= _keys(value, f"{above}{name}.")
        elif name != "names":
            found.add(above + name)
    return found
