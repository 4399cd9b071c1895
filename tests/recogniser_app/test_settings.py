"""How a shared recogniser is told what to run, and the config that Ray Serve is given."""

import json
from dataclasses import replace

import pytest

from hapticvlm_recogniser_app.settings import (
    IMPORT_PATH,
    AppSettings,
    Model,
    Scale,
    check,
    read_gallery_option,
    read_replicas,
    serve_config,
)


def test_a_gallery_is_named_and_its_path_made_absolute(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert read_gallery_option("arcade=walls") == ("arcade", str(tmp_path / "walls"))


@pytest.mark.parametrize("text", ["arcade", "=x", "arcade=", "Up=x", "a/b=x", "shipped=x"])
def test_names_that_none_can_ask_for_are_refused(text):
    with pytest.raises(ValueError, match="--gallery"):
        read_gallery_option(text)


def test_replicas_are_a_number_or_a_range():
    assert Scale() == Scale(replicas=(1, 1), gpus=0.0, queue=128)
    assert (read_replicas("3"), read_replicas("1:4")) == ((3, 3), (1, 4))
    for text in ("0", "4:1", "many", "1:"):
        with pytest.raises(ValueError, match="--replicas"):
            read_replicas(text)


@pytest.mark.parametrize(
    "settings",
    [
        AppSettings(scale=Scale(gpus=-1.0)),
        AppSettings(scale=Scale(queue=0)),
        AppSettings(scale=Scale(gpus=0.5)),
    ],
)
def test_numbers_that_no_deployment_has_are_refused(settings):
    with pytest.raises(ValueError, match="--"):
        check(settings)


def test_the_config_names_the_application_bounds_its_queues_and_scales_on_them():
    settings = AppSettings(
        Model("big/network", "cuda"),
        {"arcade": "/data/arcade"},
        Scale((1, 4), gpus=0.25, queue=64),
    )
    check(settings)
    config = serve_config(settings, "0.0.0.0", 8791)
    (app,) = config["applications"]
    (deployment,) = app["deployments"]
    assert app["import_path"] == IMPORT_PATH
    assert app["args"] == {
        "encoder": "big/network",
        "device": "cuda",
        "is_open": False,
    }
    assert deployment["user_config"] == {"galleries": {"arcade": "/data/arcade"}}
    assert (deployment["max_ongoing_requests"], deployment["max_queued_requests"]) == (32, 64)
    scaling = deployment["autoscaling_config"]
    assert (scaling["min_replicas"], scaling["max_replicas"]) == (1, 4)
    assert scaling["target_ongoing_requests"] == 16
    assert deployment["ray_actor_options"]["num_gpus"] == 0.25
    assert json.loads(json.dumps(config)) == config


def test_no_token_is_written_into_the_config():
    written = json.dumps(serve_config(replace(AppSettings()), "127.0.0.1", 1))
    assert "token" not in written.lower()
