"""The report's first figure, drawn without a drawing library."""

from xml.etree import ElementTree

import numpy as np

from hapticvlm_studio.report.confusion import svg

SVG = "{http://www.w3.org/2000/svg}"
NAMES = ["glass & ice", "<wood>", "never presented"]
COUNTS = np.array([[8, 2, 0], [0, 12, 0], [0, 0, 0]])


def drawn() -> ElementTree.Element:
    picture = svg("9 people", (NAMES, COUNTS), [("heat alone", (["hot"], np.array([[20]])))])
    return ElementTree.fromstring(picture)


def test_it_has_every_name_twice_and_every_count_but_zero() -> None:
    texts = [each.text for each in drawn().iter(f"{SVG}text")]
    assert all(texts.count(name) == 2 for name in (*NAMES, "hot"))
    assert sorted(text for text in texts if text and text.isdigit()) == ["12", "2", "20", "8"]


def test_a_shade_is_the_share_of_its_row_and_a_row_never_presented_is_blank() -> None:
    shades = [float(each.get("fill-opacity", -1)) for each in drawn().iter(f"{SVG}rect")][1:10]
    assert shades == [0.8, 0.2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]


def test_everything_lies_within_the_picture() -> None:
    root = drawn()
    width, height = float(root.get("width", 0)), float(root.get("height", 0))
    for cell in list(root.iter(f"{SVG}rect"))[1:]:
        assert 0 <= float(cell.get("x", -1)) <= width - float(cell.get("width", 0))
        assert 0 <= float(cell.get("y", -1)) <= height - float(cell.get("height", 0))
