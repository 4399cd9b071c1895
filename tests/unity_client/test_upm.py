"""The package that Unity gets from `REPOSITORY?path=/unity_client` and from a packed tarball.

Unity clones the repository and takes the folder as the package's root. This test
does so with git on a repository made of the working tree, without an editor.
"""

import json
import re
import shutil
import subprocess
import sys
import tarfile

import mono
import pytest
from toolchains import require

from hapticvlm import __version__

ROOT = mono.PACKAGE.parent
# Assemblies that are part of Unity.
TESTING = frozenset({"UnityEngine.TestRunner", "UnityEditor.TestRunner"})
# Assemblies of optional packages.
OTHERS = frozenset(
    {"Unity.InputSystem", "Unity.XR.OpenXR", "Unity.XR.Interaction.Toolkit", "Oculus.VR"}
)
WAIT_S = 600.0


def git(*arguments, cwd):
    who = ["-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "commit.gpgsign=false"]
    subprocess.run(
        ["git", *who, *arguments], cwd=cwd, check=True, capture_output=True, timeout=WAIT_S
    )


def files(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The package as Unity extracts it: a clone of a bare repository, and its folder."""
    require("git")
    folder = tmp_path_factory.mktemp("upm")
    made = folder / "made"
    shutil.copytree(mono.PACKAGE, made / "unity_client")
    for name in (".gitignore", "README.md", "LICENSE", "pyproject.toml"):
        shutil.copy(ROOT / name, made)
    git("init", "--quiet", cwd=made)
    git("add", ".", cwd=made)
    git("commit", "--quiet", "-m", "All of it", cwd=made)
    git("clone", "--quiet", "--bare", str(made), str(folder / "hapticvlm.git"), cwd=folder)
    address = (folder / "hapticvlm.git").as_uri()
    git("clone", "--quiet", "--depth", "1", address, "clone", cwd=folder)
    shutil.copytree(folder / "clone" / "unity_client", folder / "alone" / "com.hapticvlm.client")
    shutil.rmtree(folder / "clone")
    return folder / "alone" / "com.hapticvlm.client"


def manifest(package):
    return json.loads((package / "package.json").read_text())


def test_no_file_of_the_package_is_lost_on_the_way_through_git(package):
    assert files(package) == files(mono.PACKAGE)


def test_package_and_service_are_of_one_version_which_the_changelog_tells(package):
    assert manifest(package)["version"] == __version__
    newest = re.search(r"^## \[([\d.]+)\]", (package / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest
    assert newest.group(1) == __version__


def test_every_file_and_folder_unity_imports_has_its_meta_file_with_a_guid_of_its_own(package):
    hidden = re.compile(r"(^|/)(\.|[^/]*~(/|$))")
    assets = [path for path in package.rglob("*") if path.suffix != ".meta"]
    names = {path.relative_to(package).as_posix() for path in assets}
    seen = {name for name in names if not hidden.search(name)}
    metas = {name.removesuffix(".meta") for name in files(package) if name.endswith(".meta")}
    assert metas == seen
    texts = [(package / f"{name}.meta").read_text() for name in metas]
    guids = [re.findall(r"^guid: ([0-9a-f]{32})$", text, re.MULTILINE) for text in texts]
    assert {len(found) for found in guids} == {1}
    assert len({found[0] for found in guids}) == len(metas)
    check = [sys.executable, str(package / "Tools~" / "metas.py"), "--check"]
    subprocess.run(check, check=True, timeout=WAIT_S)


def test_assembly_definitions_refer_to_each_other_or_to_unity(package):
    found = [json.loads(path.read_text()) for path in package.rglob("*.asmdef")]
    names = {each["name"] for each in found}
    assert len(names) == len(found)
    for each in found:
        assert set(each["references"]) <= names | TESTING | OTHERS, each["name"]
        assert each["versionDefines"] or not OTHERS & set(each["references"]), each["name"]
        is_test = "UNITY_INCLUDE_TESTS" in each["defineConstraints"]
        assert is_test or not TESTING & set(each["references"]), each["name"]
    for source in package.rglob("*.cs"):
        owners = [path for path in source.parents if list(path.glob("*.asmdef"))]
        assert owners or "Samples~" in source.parts, source


def test_every_sample_listed_is_there_and_every_one_there_is_listed(package):
    listed = {sample["path"] for sample in manifest(package)["samples"]}
    there = {f"Samples~/{path.name}" for path in (package / "Samples~").iterdir()}
    assert listed == there
    for sample in listed:
        assert list((package / sample).glob("*.cs")), sample


def test_documents_point_to_nothing_outside_the_folder(package):
    for document in package.rglob("*.md"):
        for link in re.findall(r"\]\(([^)#\s]+)\)", document.read_text()):
            if "://" not in link:
                target = (document.parent / link).resolve()
                assert target.is_relative_to(package), (document.name, link)
                assert target.exists(), (document.name, link)


def test_the_packed_tarball_holds_every_file_of_the_package(package, tmp_path):
    require("npm")
    command = ["npm", "pack", "--silent", "--offline", "--pack-destination", str(tmp_path)]
    subprocess.run(command, cwd=package, check=True, capture_output=True, timeout=WAIT_S)
    tarball = tmp_path / f"com.hapticvlm.client-{__version__}.tgz"
    with tarfile.open(tarball) as archive:
        packed = {name.removeprefix("package/") for name in archive.getnames()}
    assert packed == files(package)


def test_the_readme_gives_every_way_to_install_this_version_and_none_needs_a_tag(package):
    text = (package / "README.md").read_text()
    assert "choose `unity_client/package.json`" in text
    assert '"$(git remote get-url origin)?path=/unity_client"' in text
    assert "#v" not in text
    assert "npm pack" in text
    assert f"com.hapticvlm.client-{__version__}.tgz" in text
