"""What is prepared for containers and releases agrees with the code. Neither was ever run here."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

from hapticvlm.commands import alive, serve
from hapticvlm.commands.main import command_line
from hapticvlm.server import service_info

ROOT = Path(__file__).parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text().replace("\\\n", " ")
STEPS = [line.split(maxsplit=1) for line in DOCKERFILE.splitlines() if line and line[0] != "#"]
KNOWN = {
    "ARG",
    "FROM",
    "WORKDIR",
    "COPY",
    "RUN",
    "USER",
    "EXPOSE",
    "HEALTHCHECK",
    "ENTRYPOINT",
    "CMD",
}


def last(instruction):
    return next(rest for name, rest in reversed(STEPS) if name == instruction)


def test_the_container_is_built_from_files_that_are_there_and_handed_to_the_builder():
    assert {name for name, _ in STEPS} <= KNOWN
    kept = {row[1:] for row in (ROOT / ".dockerignore").read_text().splitlines() if row[0] == "!"}
    for name, rest in STEPS:
        if name == "COPY" and "--from" not in rest:
            for source in rest.split()[:-1]:
                assert (ROOT / source).exists(), source
                assert source in kept, source


def test_the_extras_that_the_page_builds_a_container_with_are_ours():
    page = (ROOT / "docs" / "connecting.md").read_text()
    extras = re.findall(r"--build-arg EXTRAS=([\w,]+)", page)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert extras
    assert {name for each in extras for name in each.split(",")} <= {
        *project["optional-dependencies"]
    }
    assert "ARG EXTRAS=" in DOCKERFILE
    assert '"hapticvlm[$EXTRAS]"' in last("RUN")


def test_the_container_runs_the_service_without_root_behind_a_token():
    assert last("USER") != "root"
    words = [*yaml.safe_load(last("ENTRYPOINT")), *yaml.safe_load(last("CMD"))]
    given = command_line().parse_args(words[1:])
    options = serve.resolve_options(given, {"HAPTICVLM_TOKEN": "choose-a-long-secret"})
    assert service_info.address(options).host == "0.0.0.0"
    assert str(options.port) == last("EXPOSE")


@pytest.mark.parametrize(
    ("flags", "asked"),
    [
        ([], "http://127.0.0.1:8790/healthz"),
        (["--port", "9000"], "http://127.0.0.1:9000/healthz"),
        (["--port=9000", "--tls-cert", "a", "--tls-key", "b"], "https://127.0.0.1:9000/healthz"),
        (["--host", "172.17.0.2"], "http://172.17.0.2:8790/healthz"),
        (["--host", "::"], "http://127.0.0.1:8790/healthz"),
        (["--config", "{file}"], "http://127.0.0.1:9100/healthz"),
    ],
)
def test_the_container_asks_for_life_where_the_service_was_told_to_listen(flags, asked, tmp_path):
    config = tmp_path / "serve.toml"
    config.write_text("port = 9100\n")
    words = [*yaml.safe_load(last("ENTRYPOINT")), *yaml.safe_load(last("CMD"))]
    given = [flag.format(file=config) for flag in flags]
    assert alive.address(["python", *words, *given]) == asked
    assert "hapticvlm.commands.alive" in last("HEALTHCHECK")


def test_the_container_starts_from_one_tried_python_by_its_digest():
    stages = [rest.split() for name, rest in STEPS if name == "FROM"]
    named = {stage[-1] for stage in stages if "AS" in stage}
    (base,) = {stage[0] for stage in stages} - named
    assert re.fullmatch("python:3.13-slim@sha256:[0-9a-f]{64}", base)


def test_the_service_needs_few_packages():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert len(project["dependencies"]) <= 13
