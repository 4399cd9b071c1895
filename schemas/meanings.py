"""What messages.py says of each message, each field and each choice of words; knows no schema.

Python keeps the docstring of a class and throws away the text below a field or an assignment, so
that text is read from the source.
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
    """Return every choice of words by its name, in the order of the declaration."""
    return {
        name: get_args(value)
        for name, value in vars(messages).items()
        if get_origin(value) is Literal
    }


def of_messages() -> dict[str, str]:
    """Return what is said of each message and each type nested in one."""
    return {
        name: inspect.cleandoc(kind.__doc__)
        for name, kind in vars(messages).items()
        if inspect.isclass(kind) and kind.__module__ == messages.__name__ and kind.__doc__
    }


def of_choices() -> dict[str, str]:
    """Return what is said of each choice of words."""
    return _below(_source().body)


def of_fields() -> dict[str, dict[str, str]]:
    """Return what is said of each field: type -> field -> text."""
    return {
        node.name: _below(node.body) for node in _source().body if isinstance(node, ast.ClassDef)
    }


def _source() -> ast.Module:
    return ast.parse(Path(messages.__file__).read_text(encoding="utf-8"))


def _below(body: list[ast.stmt]) -> dict[str, str]:
    """Find the texts that stand right below an assignment or a declared field."""
    found = {}
    for above, node in pairwise(body):
        match above, node:
            case (
                ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(text))),
            ):
                found[name] = re.sub(r"\s+", " ", text)
    return found
