"""Docstrings, comments and documents name files, modules, classes and functions that exist.

A rename changes code and leaves text behind. Everything is read from the tree, so this follows a
rename by itself. CHANGELOG.md and LOG.md tell of the past and are not read.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
HISTORY = {"CHANGELOG.md", "LOG.md"}
OF_CODE = {"command-line.md"}  # texts of the parsers, which name files of the user
OTHER_CODE = {".c", ".cpp", ".cs", ".gd", ".h", ".hpp", ".html", ".js", ".mjs", ".ts"}
# Names of other programs, and keys of files, that documents give as code.
FOREIGN = {"ModemManager", "Mouse", "PhysicsMaterial", "UnityEditor", "UnityEngine"}
FOREIGN |= {"fr", "user_config"}
FILE = re.compile(r"(?<![\w./~<>{}*-])[\w/.-]*\w\.(?:py|cs)\b(?!`? of commit)")
MODULE = re.compile(r"(?<![\w./-])hapticvlm\w*(?:\.[a-z_]\w*)+")
NAME = re.compile(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*(?:\(\))?)`")
CLASS = re.compile(r"[A-Z][A-Za-z]*[a-z][A-Za-z]*")
A_FILE = re.compile(
    r"\.(cfg|crt|cs|csv|exe|h|hex|html|js|jsonl?|key|md|npz|onnx|pem|pyi?|toml|txt|wav|ya?ml)$"
)
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


@cache
def tree() -> list[Path]:
    """Every file of the repository, but what is installed, built or hidden."""
    files, folders = [], [ROOT]
    for folder in folders:
        for path in folder.iterdir():
            is_ours = path.name not in ("node_modules", "build") and path.name[0] != "."
            if path.is_dir() and is_ours and not path.is_symlink():
                folders.append(path)
            elif path.is_file() and is_ours:
                files.append(path)
    return files


@cache
def parts(path: Path) -> tuple[set[str], list[str]]:
    """Return the identifiers in the code of a file, and its texts for people."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix != ".py":
        return set(re.findall(r"[A-Za-z_]\w*", COMMENT.sub("", text))), [text]
    identifiers: set[str] = set()
    texts = re.findall(r"(?:^|\s)# .*", text)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, DOCUMENTED) and (docstring := ast.get_docstring(node)):
            texts.append(docstring)
        if not isinstance(node, ast.Constant):
            identifiers.update(each for each in vars(node).values() if type(each) is str)
    return {part for name in identifiers for part in name.split(".")}, texts


def is_defined(name: str) -> bool:
    """Whether a dotted name is a module of ours, or something in the code of one."""
    here = ROOT / "service"
    for part in name.split("."):
        if here.suffix == ".py":
            return part in parts(here)[0]
        inside = [path for path in (here / part, here / f"{part}.py") if path.exists()]
        if not inside:
            return any(part in parts(file)[0] for file in here.glob("__init__.py*"))
        here = inside[0]
    return True


@cache
def scopes() -> dict[str, set[str]]:
    """Return what is in each of our modules and packages, by its own name."""
    inside: dict[str, set[str]] = {}
    for path in tree():
        if path.suffix == ".py":
            for name in (path.stem, *(folder.name for folder in path.relative_to(ROOT).parents)):
                inside.setdefault(name, set()).update({path.stem}, parts(path)[0])
    return inside


def lost(text: str, paths: str, known: set[str]) -> Iterator[str]:
    """Yield the names in a text that are those of nothing."""
    yield from (file for file in FILE.findall(text) if f"/{file.strip('./')}\n" not in paths)
    yield from (name for name in MODULE.findall(text) if not is_defined(name))
    for name in NAME.findall(text):
        first, *rest = name.rstrip("()").split(".")
        if {first, *rest} & FOREIGN or A_FILE.search(name):
            continue
        is_of_code = rest or name.endswith(")") or CLASS.fullmatch(name)
        if is_of_code and not (first in known and scopes().get(first, known).issuperset(rest)):
            yield name


def test_a_name_in_prose_is_that_of_something_in_the_tree() -> None:
    code = [path for path in tree() if path.suffix == ".py" or path.suffix in OTHER_CODE]
    known = FOREIGN.union(*(parts(path)[0] for path in code), (path.stem for path in code))
    paths = "\n".join(f"/{path.relative_to(ROOT)}" for path in tree()) + "\n"
    read = [
        path
        for path in tree()
        if path.suffix in (".py", ".md") and path.name not in HISTORY | OF_CODE
    ]
    offenders = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in read
        for text in parts(path)[1]
        for name in lost(text, paths, known)
    }
    assert sorted(offenders) == []
