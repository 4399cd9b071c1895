"""Writes the .meta files of this package: one per file and folder, its GUID derived from the path.

Unity refers to assets by GUID, so GUIDs must never change: an entry in MOVED keeps the old GUID of
a moved file. Run without arguments to write, with --check to fail when a file is stale.
"""

from __future__ import annotations

import sys
import uuid
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
NAMESPACE = uuid.uuid5(uuid.NAMESPACE_DNS, "com.hapticvlm.client")
MOVED = {  # new path of a moved file: the GUID that it keeps
    "Editor/Persisted.cs": "05e90ea477a95d2fbe93b5e2e587ee2c",
    "Runtime/Core/Link/ConnectionLoop.cs": "c5c2946f3dc35ff882dbd7313dbb5ed6",
    "Runtime/Core/Link/SceneRegistry.cs": "fd74c458951457c9a3e98917a4b370f1",
    "Runtime/Unity/ScreenBounds.cs": "f6adca966d7d54659c654e67f51c2515",
}
IMPORTERS = {
    ".cs": "MonoImporter:\n  externalObjects: {}\n  serializedVersion: 2\n  defaultReferences: []\n"
    "  executionOrder: 0\n  icon: {instanceID: 0}\n",
    ".asmdef": "AssemblyDefinitionImporter:\n  externalObjects: {}\n",
    ".json": "TextScriptImporter:\n  externalObjects: {}\n",
    "package.json": "PackageManifestImporter:\n  externalObjects: {}\n",
    ".md": "TextScriptImporter:\n  externalObjects: {}\n",
}
TAIL = "  userData: \n  assetBundleName: \n  assetBundleVariant: \n"


def main(arguments: list[str]) -> int:
    """Write all .meta files, or with --check report stale, missing and superfluous ones."""
    expected = {Path(f"{asset}.meta"): meta(asset) for asset in assets(PACKAGE)}
    stale = [path for path, text in expected.items() if not is_current(path, text)]
    superfluous = [path for path in PACKAGE.rglob("*.meta") if path not in expected]
    if "--check" not in arguments:
        for path in stale:
            path.write_text(expected[path], encoding="utf-8")
        for path in superfluous:
            path.unlink()
        return 0
    for path in [*stale, *superfluous]:
        sys.stderr.write(f"stale: {path.relative_to(PACKAGE)}; run Tools~/metas.py\n")
    return 1 if stale or superfluous else 0


def assets(folder: Path) -> Iterator[Path]:
    """Yield every file and folder that Unity imports: it ignores `name~` and `.name`."""
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
    return head + IMPORTERS.get(asset.name, IMPORTERS[asset.suffix]) + TAIL


def guid(asset: Path) -> str:
    """Return the permanent GUID of an asset."""
    name = asset.relative_to(PACKAGE).as_posix()
    return MOVED.get(name) or uuid.uuid5(NAMESPACE, name).hex


def is_current(path: Path, text: str) -> bool:
    """Return whether this file exists and has this content."""
    return path.exists() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
