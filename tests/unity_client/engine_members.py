"""Writes Documentation~/engine-members.md: the engine members in use, and where each was seen.

The members come from the metadata of the compiled assemblies; where each was looked up stands in
engine_members.tsv (member, first version, last version of Unity's published source). A member that
is used and not in that table is listed as "not looked up". `--check` fails when the page is stale.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import mono

PAGE = mono.PACKAGE / "Documentation~" / "engine-members.md"
LOOKED_UP = Path(__file__).with_suffix(".tsv")
HEAD = """# Engine members this package uses

Made by `tests/unity_client/engine_members.py` of the repository from the metadata of the compiled
assemblies, with and without `UNITY_2022_3_OR_NEWER`; a test fails when it is stale. `.new` is a
constructor.

"Seen in" is the range of versions in whose published C# source (Unity-Technologies/
UnityCsReference; read, not copied) the member was found as it is used: name, static or not,
parameter types, accessors, public, not obsolete. The tags were 2021.3.0f1, 2021.3.9f1, 2021.3.58f1,
2022.3.0f1, 2022.3.76f1, 6000.0.78f1, 6000.3.19f1, 6000.5.2f1 and 6000.7.0a1. "stored versions"
means that one or more versions which a public code index keeps were read, not these tags.
"not looked up" members are common ones that nobody has looked up yet.

Types whose name changed: `Collider.sharedMaterial` is a `PhysicMaterial` up to 2023 and a
`PhysicsMaterial` from 6000.0. The source names neither, so it compiles for both.

| Member | Seen in |
|---|---|
"""


def used(build: mono.Build) -> list[str]:
    """Return the engine members that the package's assemblies refer to, sorted."""
    folder = build.folder / "newest"
    folder.mkdir(exist_ok=True)
    path = build.compile(
        "newest/HapticVLM.Unity.dll",
        mono.sources(mono.PACKAGE / "Runtime" / "Unity"),
        mono.QUIET,
        "-d:UNITY_2022_3_OR_NEWER",
        using=("HapticVLM.Core.dll", "UnityEngine.dll"),
    )
    assemblies = [build.folder / f"HapticVLM.{part}.dll" for part in ("Unity", "Editor")]
    # A process per assembly: two of one name cannot be loaded together.
    outputs = [build.run("components.exe", "members", str(each)) for each in (*assemblies, path)]
    names = {line for output in outputs for line in output.splitlines()}
    return sorted(name.replace("..ctor", ".new") for name in names)


def page(names: list[str]) -> str:
    """Return the page on these members."""
    rows = [line.split("\t") for line in LOOKED_UP.read_text().splitlines()]
    ranges = {name: first if first == last else f"{first} - {last}" for name, first, last in rows}
    return HEAD + "".join(f"| `{name}` | {ranges.get(name, 'not looked up')} |\n" for name in names)


def main(arguments: list[str]) -> int:
    """Write the page, or with --check say whether it is stale."""
    folder = Path(tempfile.mkdtemp())
    try:
        build = mono.Build(folder)
        for name, folders, using in (*mono.PACKAGED, *mono.PROGRAMS):
            build.compile(name, mono.sources(*folders), mono.QUIET, using=using)
        text = page(used(build))
    finally:
        shutil.rmtree(folder)
    if "--check" not in arguments:
        PAGE.write_text(text, encoding="utf-8")
        return 0
    return int(PAGE.read_text(encoding="utf-8") != text)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
