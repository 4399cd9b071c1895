"""The small charts of docs/figures.md have the numbers of the tables."""

import re
from xml.etree import ElementTree

from hapticvlm_lab.bench.small_charts import OUT, TABLES, charts


def test_each_small_chart_is_what_the_tables_say_and_is_on_the_page():
    page = (OUT.parent / "figures.md").read_text()
    for name, svg in charts():
        assert (OUT / f"{name}.svg").read_text() == svg, f"stale: {name}"
        assert f"(figures/{name}.svg)" in page
        words = " ".join(ElementTree.fromstring(svg).itertext())
        for number in re.findall(r" ([\d.]+) (?:ms|%|degC)", words):
            assert number in TABLES.read_text()


def test_no_text_of_a_chart_leaves_it():
    for name, svg in charts():
        for text in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text"):
            ends_at = (
                260 - 8 if text.get("text-anchor") == "end" else 600 - float(text.get("x", ""))
            )
            assert 6.6 * len(text.text or "") <= ends_at, (name, text.text)
