"""`hapticvlm stop` stops a running service's outputs, or reports why it could not."""

import json
import subprocess
import sys

import pytest
from conftest import peer, status

from hapticvlm.client.local_service import running


def stop(*arguments, env=None):
    return subprocess.run(
        [sys.executable, "-m", "hapticvlm", "stop", *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env=env,
    )


@pytest.fixture(scope="module")
def service():
    with running(["--token", "a token of twelve"]) as service:
        yield service


async def test_it_brings_the_outputs_of_another_owner_to_rest(service):
    token = ["--token", "a token of twelve"]
    async with peer(service) as client:
        await client.hello(token="a token of twelve")
        objects = [{"object_id": "t", "material": "wood"}]
        await client.ask(type="scene", objects=objects, replace=True)
        await client.ask(
            type="touch",
            phase="contact",
            object_id="t",
            hand="right",
            speed_mps=0.3,
            force_n=1.0,
            captured_at=0.0,
        )
        done = stop("--url", service.url, *token)
        held = status(service)["held"]
    assert done.returncode == 0, done.stderr
    assert "current of the plate is cut" in done.stdout
    assert held["right"], held


def test_one_output_can_be_stopped_alone(service):
    done = stop("speaker", "--url", service.url, "--token", "a token of twelve")
    assert done.returncode == 0, done.stderr
    assert "plate" not in done.stdout


def test_a_wrong_token_stops_nothing_and_says_so(service):
    done = stop("--url", service.url, "--token", "not the token here")
    assert done.returncode == 2
    assert "token" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_no_service_is_one_line_and_no_traceback():
    done = stop("--url", "ws://127.0.0.1:9/")
    assert done.returncode == 2
    assert "nothing listens there; nothing was stopped" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_program_gets_json_and_nothing_else(service):
    done = stop("speaker", "--json", "--url", service.url, "--token", "a token of twelve")
    assert json.loads(done.stdout) == {"stopped": "speaker"}
