"""The tests of a study in words: Markdown out of the document of numbers. Computes nothing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

Document = dict[str, Any]
PAIRS = 10


def anova(document: Document) -> str:
    """Write the tests within people."""
    if document["anova_missing"]:
        missing = f"No repeated-measures ANOVA: {document['anova_missing']}."
        return missing + _ranks(document)
    rows = [_effect(effect) for effect in document["anova"]]
    heads = ["effect", "F", "p", "p (Greenhouse-Geisser)", "partial eta squared"]
    undefined = any(effect["f"] is None for effect in document["anova"])
    note = "\n\n-: people do not differ in it at all, so F is not defined." if undefined else ""
    title = "## Two-way repeated-measures ANOVA of recognition\n\n"
    return title + _complete(document) + table(heads, rows) + note + _ranks(document)


def _complete(document: Document) -> str:
    """Return who is left out of the tests within people."""
    left_out = document["incomplete"]
    if not left_out:
        return ""
    return (
        f"Of the {document['complete']} participants who felt every pattern; without "
        f"{', '.join(left_out)}, who did not.\n\n"
    )


def _ranks(document: Document) -> str:
    rows = [
        [
            found["name"],
            f"chi2({found['df']}) = {found['chi2']:.2f}",
            f"{found['p']:.4f}",
            f"{found['w']:.2f}",
        ]
        for found in document["friedman"]
    ]
    if not rows:
        return ""
    heads = ["Friedman's test, by ranks", "chi2", "p", "Kendall's W"]
    return (
        "\n\nShares of a few trials near the ceiling are not normal; ranks do not need it:\n\n"
        + table(heads, rows)
    )


def _effect(effect: Document) -> list[str]:
    name = f"{effect['name']}"
    degrees = f"F({effect['df']}, {effect['df_error']})"
    if effect["f"] is None:
        return [name, f"{degrees} -", "-", "-", "-"]
    corrected = effect["p_corrected"]
    return [
        name,
        f"{degrees} = {effect['f']:.2f}",
        f"{effect['p']:.4f}",
        "-" if corrected is None else f"{corrected:.4f} (epsilon {effect['epsilon']:.2f})",
        f"{effect['partial_eta2']:.3f}",
    ]


def printed(document: Document) -> str:
    """Write what the paper prints of its ANOVA, computed anew."""
    rows = []
    for each in document.get("printed_anova", ()):
        as_printed = each["as_printed"]
        two_way = each["two_way_df"]
        rows.append(
            [
                as_printed["name"],
                f"F({as_printed['df']}, {as_printed['df_error']}) = {as_printed['f']:.2f}",
                f"{each['printed_p']:g}",
                f"{as_printed['p']:.4f}",
                f"{as_printed['partial_eta2']:.3f}",
                f"F({two_way['df']}, {two_way['df_error']}): {two_way['p']:.2f}",
            ]
        )
    heads = ["effect", "printed, F recovered", "printed p", "p of that F", "partial eta squared"]
    heads.append("p on a 5 x 2 design's df")
    return "## The printed ANOVA, recomputed\n\n" + table(heads, rows) if rows else ""


def pairs(document: Document) -> str:
    """Write the tests of two patterns at a time."""
    found = document["pairwise"]
    if not found:
        return ""
    rows = [
        [
            f"{pair['first']} - {pair['second']}",
            f"{100 * pair['difference']:+.1f} %",
            f"{pair['p']:.4f}",
            f"{pair['p_holm']:.3f}",
        ]
        for pair in found[:PAIRS]
    ]
    below = sum(pair["p_holm"] < 0.05 for pair in found)
    return (
        f"## Pairs of patterns\n\n{document['pairwise_test']}; {len(found)} pairs, {below} with a "
        f"corrected p below 0.05. The first {len(rows)}:\n\n"
        + table(["pair", "difference", "p", "p after Holm"], rows)
    )


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Write a table of Markdown."""
    lines = [list(heads)]
    lines += [["---"] * len(lines[0]), *(list(row) for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
