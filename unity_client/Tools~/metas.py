"""Writes the .meta files of this package: one per file and folder, its GUID made from the path.

Unity knows assets by these GUIDs, so they must never change: a moved file keeps its old GUID by an
entry in MOVED. Run without arguments to write, with --check to fail when a file is stale.
"""

from __future__ import annotations

import sys
import uuid
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
# Samples whose files refer to each other: Unity copies their .meta files along.
SAMPLES = (PACKAGE / "Samples~" / "Mouse",)
NAMESPACE = uuid.uuid5(uuid.NAMESPACE_DNS, "com.hapticvlm.client")
MOVED: dict[str, str] = {}  # new path: the path whose GUID it keeps
IMPORTERS = {
    ".cs": "MonoImporter:\n  externalObjects: {}\n  serializedVersion: 2\n  defaultReferences: []\n"
    "  executionOrder: 0\n  icon: {instanceID: 0}\n",
    ".asmdef": "AssemblyDefinitionImporter:\n  externalObjects: {}\n",
    ".json": "PackageManifestImporter:\n  externalObjects: {}\n",
    ".unity": "DefaultImporter:\n  externalObjects: {}\n",
    ".prefab": "PrefabImporter:\n  externalObjects: {}\n",
    ".md": "TextScriptImporter:\n  externalObjects: {}\n",
}
TAIL = "  userData: \n  assetBundleName: \n  assetBundleVariant: \n"


def main(arguments: list[str]) -> int:
    """Write all .meta files, or with --check say which are stale, missing or left over."""
    found = [asset for folder in (PACKAGE, *SAMPLES) for asset in assets(folder)]
    wanted = {Path(f"{asset}.meta"): meta(asset) for asset in found}
    stale = [path for path, text in wanted.items() if not is_current(path, text)]
    left_over = [path for path in PACKAGE.rglob("*.meta") if path not in wanted]
    if "--check" not in arguments:
        for path in stale:
            path.write_text(wanted[path], encoding="utf-8")
        for path in left_over:
            path.unlink()
        return 0
    for path in [*stale, *left_over]:
        sys.stderr.write(f"stale: {path.relative_to(PACKAGE)}; run Tools~/metas.py\n")
    return 1 if stale or left_over else 0


def assets(folder: Path) -> Iterator[Path]:
    """Yield every file and folder that Unity imports: none ending in ~ or starting with a dot."""
    for path in sorted(folder.iterdir()):
        if path.name.endswith("~") or path.name.startswith(".") or path.suffix == ".meta":
            continue
        yield path
        if path.is_dir():
            yield from assets(path)


def meta(asset: Path) -> str:
    """Return the text of an asset's .meta file."""
    head = f"fileFormatVersion: 2\nguid: {guid(asset)}\n"
    if asset.is_dir():
        return f"{head}folderAsset: yes\nDefaultImporter:\n  externalObjects: {{}}\n{TAIL}"
    return head + IMPORTERS[asset.suffix] + TAIL


def guid(asset: Path) -> str:
    """Return the GUID that an asset has for ever."""
    name = asset.relative_to(PACKAGE).as_posix()
    return uuid.uuid5(NAMESPACE, MOVED.get(name, name)).hex


def is_current(path: Path, text: str) -> bool:
    """Whether this file exists and says this."""
    return path.exists() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
