"""A page in one file runs its own script and nothing else."""

import base64
import hashlib
import re

import numpy as np
import pytest

from hapticvlm.recordings.page.one_file import plan
from hapticvlm.recordings.page.page import page
from hapticvlm.rendering.vibration.vibration import RATE_HZ

HOSTILE = {"title": "</script><script>steal()</script>"}


def test_the_policy_admits_the_one_script_by_its_hash_and_no_address():
    markup = page(HOSTILE)
    (script,) = re.findall(r'<script type="module">(.*?)</script>', markup, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="(.*?)"', markup)
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["script-src"] == f"'sha256-{digest}'"
    assert rules["default-src"] == "'none'"
    assert markup.index(policy) < markup.index("<script")
    assert "steal()</script>" not in markup


def test_the_one_script_imports_nothing():
    assert not re.search(r"^(import|export) ", page({}), re.MULTILINE)


def test_a_phone_plays_what_the_speaker_plays_at_the_same_time():
    at_s = np.arange(RATE_HZ) / RATE_HZ
    wave = np.where(at_s < 0.5, 0.2 * np.sin(2 * np.pi * 160.0 * at_s), 0.0).astype(np.float32)
    played = plan(wave)
    amplitude = np.array(played["amplitude"])
    assert amplitude.size * played["period_ms"] == pytest.approx(1000.0)
    loud, quiet = amplitude[:40], amplitude[42:]  # the filter smears an end by a period or two
    assert loud.min() > 0.5
    assert quiet.max() < 0.2
    assert plan(wave[:0])["amplitude"] == []
