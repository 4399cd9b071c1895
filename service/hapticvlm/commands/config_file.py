"""Reads a config file: TOML with the names of the flags, checked by the protocol's validator.

A name may be at the top of the file or in the table of its group ([connections], [outputs], ...).
"""

from __future__ import annotations

import argparse
import difflib
import logging
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import UNSET, Meta, UnsetType

from hapticvlm import documents
from hapticvlm.errors import UsageError
from hapticvlm.server.options import Option
from hapticvlm.server.settings import GROUPS, OPTIONS

logger = logging.getLogger(__name__)

_BY_NAME = {option.name: option for option in OPTIONS}


def _type(option: Option) -> Any:  # noqa: ANN401 - a type
    """Return the type that the validator expects in a file."""
    kind: Any = str if option.kind is Path else option.kind
    if option.details.range is not None:
        low, high = option.details.range
        kind = Annotated[kind, Meta(ge=option.kind(low), le=option.kind(high))]
    if option.details.bare is not None:
        kind = kind | bool
    return kind | UnsetType if option.details.read is None else kind | str | UnsetType


def _struct(name: str, members: Mapping[str, Any]) -> type[msgspec.Struct]:
    declared = [(member.replace("-", "_"), kind, UNSET) for member, kind in members.items()]
    return msgspec.defstruct(
        name, declared, frozen=True, forbid_unknown_fields=True, rename="kebab"
    )


_TABLES = {
    group: _struct(
        group, {option.name: _type(option) for option in OPTIONS if option.details.group == group}
    )
    for group in GROUPS
}
_FILE = _struct(
    "File",
    {option.name: _type(option) for option in OPTIONS}
    | {group: table | UnsetType for group, table in _TABLES.items()},
)


def read(path: Path) -> dict[str, Any]:
    """Return the file's options by field of `ServeOptions`; its paths are relative to it.

    Raises UsageError when there is no such file, and ValueError naming the file, the field, the
    allowed values and what to do.
    """
    try:
        checked = documents.read_toml(path, _FILE)
    except OSError as error:
        raise UsageError(f"--config {path}: {error.strerror}; give a TOML file") from None
    except msgspec.ValidationError as error:
        raise ValueError(f"{path}: {_explain(str(error))}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {documents.reason(error)}") from None
    values = _flat(path, checked)
    _guard_secrets(path, values)
    try:
        return {
            _BY_NAME[name].field: _value(_BY_NAME[name], value, path.parent)
            for name, value in values.items()
            if value is not False or _BY_NAME[name].kind is bool
        }
    except argparse.ArgumentTypeError as error:
        raise ValueError(f"{path}: {error}") from None


def _flat(path: Path, checked: msgspec.Struct) -> dict[str, Any]:
    """Return names and values, of whichever table. Raises ValueError for duplicates."""
    values: dict[str, Any] = {}
    tables = [getattr(checked, group) for group in GROUPS]
    for part in (checked, *(table for table in tables if table is not UNSET)):
        for name in part.__struct_fields__:
            value = getattr(part, name)
            option_name = name.replace("_", "-")
            if value is UNSET or option_name in GROUPS:
                continue
            if option_name in values:
                group = _BY_NAME[option_name].details.group
                raise ValueError(f"{path}: {option_name}: set both at the top and in [{group}]")
            values[option_name] = value
    return values


def _guard_secrets(path: Path, values: Mapping[str, Any]) -> None:
    """Warn of a secret that other users of this machine can read."""
    secrets = [name for name in values if _BY_NAME[name].details.env]
    if secrets and os.name == "posix" and path.stat().st_mode & 0o077:
        warning = "%s contains a %s and other users can read it: run chmod 600 %s"
        logger.warning(warning, path, secrets[0], path)


def _value(option: Option, value: Any, folder: Path) -> Any:  # noqa: ANN401 - of any option
    if value is True and option.details.bare is not None:
        return option.details.bare
    if option.details.read is not None and isinstance(value, str):
        return _read(option, folder / value)
    if option.kind is Path:
        return folder / Path(value).expanduser()
    if option.details.names_path and os.path.exists(folder / value):  # noqa: PTH110 - false for an invalid name
        return str(folder / value)
    return value


def _read(option: Option, file: Path) -> float:
    """Read the value of an option from a file. Raises ArgumentTypeError."""
    assert option.details.read is not None
    assert option.details.range is not None
    value: float = option.details.read(str(file))
    low, high = option.details.range
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(
            f"{option.name}: {file} has {value:g}; it must be {option.accepted}"
        )
    return value


def _explain(reason: str) -> str:
    """Convert the validator's message to the field, the fault and the allowed values."""
    fault, _, place = reason.partition(" - at ")
    where = re.sub(r"\[\d+\]", "", place.strip("`").removeprefix("$").removeprefix("."))
    unknown = re.fullmatch(r"Object contains unknown field `(.*)`", fault)
    if unknown is not None:
        return _explain_unknown(unknown[1], where)
    option = _BY_NAME.get(where.rpartition(".")[2])
    cure = f"a table, as in [{where}]" if option is None else option.accepted
    return f"{where}: {fault[0].lower()}{fault[1:]}; give {cure}"


def _explain_unknown(name: str, table: str) -> str:
    where = f"{table}.{name}" if table else name
    dashed = name.replace("_", "-")
    option = _BY_NAME.get(dashed)
    if option is not None and option.name != name:
        return f"{where}: names have dashes: write {option.name}"
    if option is not None:
        return f"{where}: wrong table; write it in [{option.details.group}] or above all tables"
    near = difflib.get_close_matches(dashed, [*_BY_NAME, *GROUPS], 1)
    guess = f"did you mean {near[0]}?" if near else "the names are those of the flags"
    return f"{where}: no such option; {guess} (`hapticvlm serve --help` lists them)"
