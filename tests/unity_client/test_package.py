"""The package as Unity imports it: manifest, .meta files, its own tests, and engine members."""

import json
import re
import subprocess

import engine_members
import mono
import numpy as np
import pytest

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command, Voices

pytest_plugins = ("mono_build",)
PACKAGE = mono.PACKAGE
ADDRESSES = ("documentationUrl", "changelogUrl", "licensesUrl")


def test_the_package_s_own_tests_of_the_core_pass_under_nunit(build):
    done = subprocess.run(
        ["nunit-console", "-nologo", "-noxml", "HapticVLM.Tests.Editor.dll"],
        cwd=build.folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    ran = re.search(r"Tests run: (\d+), Errors: 0, Failures: 0", done.stdout)
    assert ran, done.stdout
    assert int(ran.group(1)) > 50


def test_the_package_s_own_play_mode_tests_pass_in_the_stub_player(build):
    output = build.run(
        "components.exe", "PlayMode.Run", str(build.folder / "HapticVLM.Tests.Runtime.dll")
    )
    assert "play mode tests passed 4" in output


@pytest.fixture(scope="module")
def optional(build):
    """The parts that need other packages, compiled against stand-ins of these."""
    for name, folders, using in (*mono.OPTIONAL, mono.STREAMS):
        build.compile(name, mono.sources(*folders), mono.QUIET, "-d:UNITY_EDITOR", using=using)
    runtime = mono.HERE / "optional_stubs" / "openxr_runtime.c"
    library = build.folder / "libopenxr_runtime.so"
    command = ["cc", "-shared", "-fPIC", "-Wall", "-Werror", "-o", str(library), str(runtime)]
    subprocess.run(command, check=True, timeout=120)
    return build


@pytest.mark.usefixtures("optional")
def test_the_parts_for_other_packages_compile_and_are_left_out_without_them():
    for name, folders, _ in mono.OPTIONAL[1:]:
        definition = json.loads((folders[0] / name.replace(".dll", ".asmdef")).read_text())
        defines = {each["define"] for each in definition["versionDefines"]}
        assert defines == set(definition["defineConstraints"])


def test_meta_s_parametric_haptics_are_streamed_as_its_page_asks(optional):
    sent = optional.run("streams.exe").split("\n")
    first, *later = [re.findall(r"[\d.]+", line) for line in sent if line]
    assert (first[0], first[1], first[3]) == ("1", "0", "0.60")
    assert int(first[2]) >= 30  # ms, as the controller requires
    *frames, stop = later
    assert len(frames) == 4  # every second display frame, as the controller requires 20 ms
    ends = int(first[2])
    for kind, begin, end, most in frames:
        assert (kind, int(begin), most) == ("2", ends + 5, "0.60")  # no gap and no overlap
        ends = int(end)
    assert (stop[0], stop[3]) == ("0", "0.00")


@pytest.fixture(scope="module")
def sampled(optional):
    """What a stand-in of Quest's runtime took of touches of the bake."""
    return optional.run("streams.exe", "samples", timeout=900.0)


def test_a_runtime_that_takes_samples_receives_the_sound_of_the_service_s_palm(sampled):
    waves = re.findall(r"^wave (\w+) (\w+) (.+)$", sampled, re.MULTILINE)
    assert [(kind, material) for kind, material, _ in waves] == [
        (kind, material) for material in ("wood", "glass") for kind in ("strike", "slide")
    ]
    for kind, material, samples in waves:
        wave = np.array(samples.split(), float)
        assert np.abs(wave).max() <= 1.0
        own = [level_db(of_the_service(material, kind, seed), RATE_HZ, kind) for seed in range(4)]
        assert min(own) - 1.0 < level_db(wave, 2000, kind) < max(own) + 1.0, (kind, material)


def test_samples_end_at_a_stop_and_impulses_play_where_a_controller_takes_none(sampled):
    for line in (
        "impulses 0 appended True",
        "bytes 0",  # of a frame that sends
        "stopped at once True amplitude 0",
        "after the stop 0",
        "without samples amplitude True",
    ):
        assert line in sampled.splitlines()


def of_the_service(material, kind, seed):
    voices = Voices(1.0, MATERIALS, fills_caches=False)
    wave = []
    for block in range(100 if kind == "slide" else 30):
        if kind == "slide" or block == 0:
            motion, ends = Motion(0.3, 1.5), 0.01 * block + 0.25
            voices.apply(Command(1, material, kind, block == 0, motion, seed, ends))
        wave.append(voices.render(RATE_HZ // 100, 0.01 * block))
    return np.concatenate(wave).astype(float)


def level_db(wave, rate_hz, kind):
    """Return the mean level of a slide after its first contact, or the energy of an impact, dB."""
    if kind == "slide":
        return 10.0 * np.log10(np.mean(wave[rate_hz // 5 : rate_hz] ** 2))
    return 10.0 * np.log10(np.sum(wave**2) / rate_hz)


def test_every_assembly_is_there_on_every_platform_of_those_that_refer_to_it():
    definitions = {
        each["name"]: each
        for each in (json.loads(path.read_text()) for path in PACKAGE.rglob("*.asmdef"))
    }
    assert len(definitions) >= 8
    assert definitions["HapticVLM.Core"]["noEngineReferences"]  # it is compiled alone here
    for definition in definitions.values():
        for name in set(definition["references"]) & set(definitions):
            referred = definitions[name]
            assert not referred["excludePlatforms"], f"{name} is missing for its users there"
            only = referred["includePlatforms"]
            assert not only or definition["includePlatforms"] == only, (definition["name"], name)


def test_the_manifest_is_what_a_registry_of_packages_takes_and_names_no_invented_address():
    manifest = json.loads((PACKAGE / "package.json").read_text())
    assert re.fullmatch(r"[a-z0-9-]+(\.[a-z0-9-]+){2,}", manifest["name"])
    assert re.fullmatch(r"\d+\.\d+\.\d+(-[0-9A-Za-z.-]+)?", manifest["version"])
    assert manifest["unity"] == "2021.3"
    assert manifest["author"]["name"]
    assert manifest["license"] == "MIT"
    assert manifest["keywords"] == [word for word in manifest["keywords"] if word == word.lower()]
    assert {*manifest["samples"][0]} == {"displayName", "description", "path"}
    given = {field: manifest[field] for field in ADDRESSES if field in manifest}
    assert all(str(address).startswith("https://") for address in given.values())
    text = (PACKAGE / "Documentation~" / "index.md").read_text()
    assert given or all(f"`{field}`" in text for field in (*ADDRESSES, "repository"))
    for name in ("CHANGELOG.md", "LICENSE.md", "Documentation~/index.md"):  # opened by Unity
        assert (PACKAGE / name).stat().st_size > 0


def test_each_engine_member_in_use_is_declared_in_the_stand_in_as_in_three_versions_of_unity(build):
    assert engine_members.differences(build) == []


def test_a_member_of_the_stand_in_with_another_signature_is_told_from_the_engine_s():
    raycast = "static bool(Ray, out RaycastHit, float, int, QueryTriggerInteraction)"
    assert engine_members.is_compatible(raycast, raycast)
    assert engine_members.is_compatible("int get", "int get/set")
    assert engine_members.is_compatible("void(Action<A, B>)", "void(Action<A, B>, int = default)")
    for other in (raycast.replace("out ", ""), raycast[7:], raycast.replace("int, ", "")):
        assert not engine_members.is_compatible(raycast, other)
    assert not engine_members.is_compatible("int set", "int get")
    assert not engine_members.is_compatible("void(int)", "void(int, int)")


def test_nothing_of_the_package_is_larger_than_a_reader_can_hold():
    for source in PACKAGE.rglob("*.cs"):
        if not source.name.endswith(".g.cs"):
            assert len(source.read_text().splitlines()) <= 600, source


def test_the_readme_s_way_to_the_first_touch_has_at_most_five_steps():
    text = (PACKAGE / "README.md").read_text()
    section = text.split("## First decision")[1].split("\n## ")[0]
    steps = re.findall(r"^(\d+)\. ", section, re.MULTILINE)
    assert 1 <= len(steps) <= 5
    assert steps == [str(number + 1) for number in range(len(steps))]
