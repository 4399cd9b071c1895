"""Compares the stand-in of the engine with Unity's published source, for each member in use.

engine_members.tsv has each member's signature in three versions: member, signature, versions (`all`
or a list), with the commits at its head. The package's use of a member comes from the metadata of
its compiled assemblies, so it has the signature that the stand-in declares.
"""

from __future__ import annotations

import re
from pathlib import Path

import mono

VERSIONS = ("2021.3", "2022.3", "6000.3")
LISTED = Path(__file__).with_suffix(".tsv")
# The source names neither type of a collider's material, so that it compiles for both.
RENAMED = {"PhysicsMaterial": "PhysicMaterial"}


def used(build: mono.Build) -> list[str]:
    """Return the engine members that the package's assemblies refer to: name, tab, signature.

    What is compiled for 2022.3 and later alone (UNITY_2022_3_OR_NEWER) is not among them.
    """
    assemblies = [build.folder / f"HapticVLM.{part}.dll" for part in ("Unity", "Editor")]
    # One process per assembly, because two of the same name cannot be loaded together.
    outputs = [build.run("components.exe", "Members.Print", str(each)) for each in assemblies]
    return sorted({line for output in outputs for line in output.splitlines() if "\t" in line})


def listed() -> dict[tuple[str, str], list[str]]:
    """Return Unity's signatures of each member in each version; overloads are several."""
    found: dict[tuple[str, str], list[str]] = {}
    for line in LISTED.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        name, signature, versions = line.split("\t")
        for version in VERSIONS if versions == "all" else versions.split():
            found.setdefault((name, version), []).append(signature)
    return found


def is_compatible(use: str, real: str) -> bool:
    """Return whether C# that compiles for the first signature compiles for the second as well."""
    for new, old in RENAMED.items():
        real = real.replace(new, old)
    if "(" not in use:
        kind, _, accessor = use.rpartition(" ")
        if accessor not in ("get", "set"):
            return use == real
        return real.rpartition(" ")[0] == kind and accessor in real.rpartition(" ")[2].split("/")
    head, parameters = _parts(use)
    real_head, real_parameters = _parts(real)
    rest = real_parameters[len(parameters) :]
    same = [each.removesuffix(" = default") for each in real_parameters[: len(parameters)]]
    may_be_left_out = all(each.endswith("= default") or "params " in each for each in rest)
    return head == real_head and same == parameters and may_be_left_out


def _parts(signature: str) -> tuple[str, list[str]]:
    """Return what stands before the parameters, and each of these."""
    head, _, inside = signature.removesuffix(")").partition("(")
    return head, re.findall(r"(?:[^,<]|<[^>]*>)+", inside.replace(", ", ",")) if inside else []


def differences(build: mono.Build) -> list[str]:
    """Return the members in use that a version of Unity lacks or declares otherwise."""
    real = listed()
    wrong = []
    for name, use in (line.split("\t") for line in used(build)):
        for version in VERSIONS:
            signatures = real.get((name, version), [])
            if not any(is_compatible(use, each) for each in signatures):
                wrong.append(f"{name} {use}: Unity {version} has {signatures or 'not been read'}")
    return wrong
