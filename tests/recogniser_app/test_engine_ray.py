"""A Ray that takes longer to start than it allows itself, as on a busy machine."""

import warnings

import pytest
from toolchains import require

from hapticvlm_recogniser_app import engine_ray

pytestmark = pytest.mark.nightly


@pytest.fixture
def slow_ray(monkeypatch):
    """Return how often Ray was started, and let it be too slow for so many times first."""
    require("ray")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warnings of Ray about its own modules
        import ray
    starts: list[int] = []

    def set_slow(times):
        def init(**_):
            starts.append(len(starts))
            if len(starts) <= times:
                raise Exception("The current node timed out during startup")  # Ray's own words

        monkeypatch.setattr(ray, "init", init)
        return starts

    return set_slow


def test_a_ray_that_was_too_slow_is_started_again(slow_ray, tmp_path):
    starts = slow_ray(2)
    engine_ray._start(1, str(tmp_path))
    assert len(starts) == 3


def test_a_ray_that_never_starts_is_an_error_that_says_what_to_do(slow_ray, tmp_path):
    starts = slow_ray(9)
    with pytest.raises(engine_ray.RayError, match=r"timed out.*; free processor and memory"):
        engine_ray._start(1, str(tmp_path))
    assert len(starts) == engine_ray.ATTEMPTS
