"""Figures of a study: nothing lies on the data."""

from hapticvlm_studio.report import plots
from hapticvlm_studio.report.statistics import Share


def test_the_legend_of_recognition_stands_below_the_rows():
    shares = [(f"pattern {n}", Share(n, 10, n / 10, (0.1, 0.9), (0.2, 0.8))) for n in range(1, 11)]
    figure = plots._figure(7.5, 6.0)
    axes = figure.subplots()
    plots._draw_shares(axes, shares, 0.1)
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert axes.get_legend() is None
    below = axes.get_tightbbox()
    assert below is not None
    assert legend.get_window_extent().y1 <= below.y0 + 1.0
