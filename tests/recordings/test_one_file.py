"""A page in one file runs its own script and nothing else."""

import base64
import hashlib
import re

from hapticvlm.recordings.page.page import page

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
