"""Compiles the Unity package, the engine stubs and the test programs with mcs, and runs them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from toolchains import give_up

HERE = Path(__file__).parent
PACKAGE = HERE.parents[1] / "unity_client"
NEEDED = ("mono", "mcs", "nunit-console")
NUNIT = Path("/usr/lib/cli/nunit.framework-2.6.3/nunit.framework.dll")
RESOURCES = {"UNITY_RESOURCES": str(PACKAGE / "Runtime" / "Baked" / "Resources")}  # of the stubs
FLAGS = ("-langversion:7.2", "-warnaserror", "-debug", "-optimize+", "-r:System.Numerics.dll")
LEGACY_INPUT = "-d:ENABLE_LEGACY_INPUT_MANAGER"  # "Active Input Handling" of a project
INPUT_SYSTEM = "-d:ENABLE_INPUT_SYSTEM"  # the setting;
INPUT_PACKAGE = "-d:HAPTICVLM_INPUT_SYSTEM"  # the package that it needs


def require() -> None:
    """Skip, or fail where CI is set, when Mono or NUnit is missing."""
    missing = [name for name in NEEDED if not shutil.which(name)]
    missing += [] if NUNIT.exists() else ["nunit.framework.dll"]
    if missing:
        give_up(f"no {', '.join(missing)}: run .ci/toolchains as root")


def figure(output: str, name: str) -> float:
    """Return the number that a program printed behind a name, which may be a pattern."""
    found = re.search(rf"\b{name} (-?[\d.]+(?:E-?\d+)?)", output)
    assert found, output
    return float(found.group(1))


def sources(*folders: Path) -> list[Path]:
    return sorted(path for folder in folders for path in folder.rglob("*.cs"))


@dataclass(frozen=True)
class Build:
    """A folder of compiled assemblies."""

    folder: Path

    def compile(
        self, name: str, files: list[Path], *flags: str, using: tuple[str, ...] = ()
    ) -> Path:
        target = self.folder / name
        target.parent.mkdir(exist_ok=True)
        kind = "exe" if name.endswith(".exe") else "library"
        references = [f"-r:{self.folder / other}" for other in using]
        if not {LEGACY_INPUT, INPUT_SYSTEM} & {*flags}:
            flags = (LEGACY_INPUT, *flags)
        command = ["mcs", *FLAGS, f"-target:{kind}", f"-out:{target}", *references, *flags]
        done = subprocess.run(
            [*command, *map(str, files)], capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return target

    def run(
        self,
        program: str,
        *arguments: str,
        text: str = "",
        timeout: float = 300.0,
        variables: Mapping[str, str] = MappingProxyType({}),
    ) -> str:
        """Run one of the test programs and return what it printed."""
        done = subprocess.run(
            ["mono", "--debug", str(self.folder / program), *arguments],
            input=text,
            capture_output=True,
            text=True,
            timeout=timeout,
            env=os.environ | RESOURCES | dict(variables),
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


# Assemblies in the order of compilation: name, folders, references.
PACKAGED = (
    ("HapticVLM.Core.dll", (PACKAGE / "Runtime" / "Core",), ()),
    ("HapticVLM.Baked.dll", (PACKAGE / "Runtime" / "Baked",), ()),
    ("UnityEngine.dll", (HERE / "stubs",), ()),
    ("UnityEditor.dll", (HERE / "editor_stubs",), ("UnityEngine.dll",)),
    (
        "HapticVLM.Unity.dll",
        (PACKAGE / "Runtime" / "Unity",),
        ("HapticVLM.Core.dll", "HapticVLM.Baked.dll", "UnityEngine.dll"),
    ),
)
# Parts that compile only in projects with these packages.
OPTIONAL = (
    ("Packages.dll", (HERE / "optional_stubs",), ("UnityEngine.dll",)),
    *(
        (
            f"HapticVLM.{part}.dll",
            (PACKAGE / "Runtime" / part,),
            ("HapticVLM.Core.dll", "HapticVLM.Unity.dll", "UnityEngine.dll", "Packages.dll"),
        )
        for part in ("OpenXR", "Interaction", "Meta")
    ),
)
STREAMS = (
    "streams.exe",
    (HERE / "optional_programs",),
    (
        "HapticVLM.Core.dll",
        "HapticVLM.Unity.dll",
        "UnityEngine.dll",
        "Packages.dll",
        "HapticVLM.Meta.dll",
        "HapticVLM.OpenXR.dll",
    ),
)
ENGINE = (
    "HapticVLM.Core.dll",
    "HapticVLM.Baked.dll",
    "HapticVLM.Unity.dll",
    "UnityEngine.dll",
    "UnityEditor.dll",
)
PROGRAMS = (
    ("HapticVLM.Editor.dll", (PACKAGE / "Editor",), ENGINE),
    # Includes the core's sources, because it uses their internal types.
    ("programs.exe", (HERE / "csharp", PACKAGE / "Runtime" / "Core"), ()),
    ("baked.exe", (HERE / "baked", PACKAGE / "Runtime" / "Baked"), ()),
    ("components.exe", (HERE / "components",), (*ENGINE, "HapticVLM.Editor.dll")),
)
TESTS = (
    ("HapticVLM.Tests.Editor.dll", (PACKAGE / "Tests" / "Editor",), ("HapticVLM.Core.dll",)),
    ("HapticVLM.Tests.Runtime.dll", (PACKAGE / "Tests" / "Runtime",), ENGINE),
    ("samples.dll", (PACKAGE / "Samples~",), ENGINE),
)
# Serialised fields are assigned only by the engine, so these two warnings are wrong.
QUIET = "-nowarn:0649,0414"
