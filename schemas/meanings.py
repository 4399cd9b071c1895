"""Reads the descriptions of messages, fields and choices of values from messages.py.

Python keeps the docstring of a class but discards the text below a field or an assignment, so this
module reads that text from the source.
"""

from __future__ import annotations

import ast
import inspect
import re
from itertools import pairwise
from pathlib import Path
from typing import Literal, get_args, get_origin

from hapticvlm import messages


def choices() -> dict[str, tuple[str, ...]]:
    """Return every choice of values by its name, in the order of declaration."""
    return {
        name: get_args(value)
        for name, value in vars(messages).items()
        if get_origin(value) is Literal
    }


def of_messages() -> dict[str, str]:
    """Return the description of each message and nested type."""
    return {
        name: inspect.cleandoc(kind.__doc__)
        for name, kind in vars(messages).items()
        if inspect.isclass(kind) and kind.__module__ == messages.__name__ and kind.__doc__
    }


def of_choices() -> dict[str, str]:
    """Return the description of each choice of values."""
    return _below(_source().body)


def of_fields() -> dict[str, dict[str, str]]:
    """Return the description of each field: type -> field -> text."""
    return {
        node.name: _below(node.body) for node in _source().body if isinstance(node, ast.ClassDef)
    }


def _source() -> ast.Module:
    return ast.parse(Path(messages.__file__).read_text(encoding="utf-8"))


def _below(body: list[ast.stmt]) -> dict[str, str]:
    """Return the text directly below each assignment or declared field."""
    found = {}
    for above, node in pairwise(body):
        match above, node:
            case (
                ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(text))),
            ):
                found[name] = re.sub(r"\s+", " ", text)
    return found
