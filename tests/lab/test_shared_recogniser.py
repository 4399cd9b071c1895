"""The arithmetic of the load test: service curve, gain of batching, right answers."""

from dataclasses import replace
from pathlib import Path

import pytest

from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.remote.contract import RemoteMatch, write_result
from hapticvlm_lab.bench import shared_recogniser as curve
from hapticvlm_lab.bench.shared_recogniser_scenes import Truth, recorded
from hapticvlm_recogniser_app.replies import Named, identify

LINE = {size: 0.004 + 0.001 * size for size in curve.SIZES}


def test_the_line_through_a_service_curve_is_found():
    fitted = curve.fit(LINE)
    assert fitted.fixed_s == pytest.approx(0.004)
    assert fitted.each_s == pytest.approx(0.001)
    assert fitted.service_s(3) == pytest.approx(0.007)
    assert fitted.rate(16) == pytest.approx(16 / 0.020)


def test_batching_gains_what_its_fixed_cost_is_shared_by():
    fitted = curve.fit(LINE)
    assert curve.gain({1: 10}, fitted) == pytest.approx(1.0)
    assert curve.gain({16: 10}, fitted) == pytest.approx(16 / 0.020 * 0.005)


def test_a_deployments_gain_is_by_its_own_core_seconds():
    used = {1: 10 * 0.005, 16: 10 * 0.020}
    assert curve.deployed_gain({1: 10, 16: 10}, used) == pytest.approx(170 / 0.25 / 200)
    assert curve.deployed_gain({16: 10}, used) is None


def test_an_answer_is_right_only_for_the_gallery_it_names():
    encoder = load_encoder()
    gallery = load_gallery(encoder=encoder)
    unsure = replace(gallery, calibration=replace(gallery.calibration, scale=0.3))
    named = [Named(identify(encoder, one, "arcade"), one) for one in (gallery, unsure)]
    crops = recorded(Path("examples/captures/living_room"), encoder)
    embedding = encoder.embed(crops[:1])[0]
    result = write_result(RemoteMatch(gallery.match(embedding), embedding))
    truth = Truth(named)
    assert truth.is_right(named[0].identity.hash, result)
    assert not truth.is_right(named[1].identity.hash, result)
    assert not truth.is_right("another", result)
