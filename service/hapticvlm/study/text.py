"""The report of a study in words: Markdown out of the document of numbers. Computes nothing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

Document = dict[str, Any]
PAIRS = 10


def text_of(document: Document) -> str:
    """Write the report."""
    parts = [_head(document), _patterns(document), _axes(document), _bits(document)]
    parts += [_anova(document), _printed(document), _pairs(document), _notes(document)]
    return "\n\n".join(part for part in parts if part)


def people(count: int) -> str:
    """Say how many took part."""
    return f"{count} participant{'' if count == 1 else 's'}"


def _head(document: Document) -> str:
    lines = ["# Study report", ""]
    if document["simulated"]:
        lines += [
            "**Devices were SIMULATED: nobody felt anything, so this says nothing of people.**"
        ]
        lines += [""]
    lines.append(
        f"{people(document['participants'])}, {document['answered']} of "
        f"{document['planned']} trials answered, {document['excluded']} left out because a device "
        f"did not present its pattern{_repeats(document)}."
    )
    whole, chance = document["recognition"], document["chance"]
    lines.append(f"Recognised: {_share(whole)}; chance {100 * chance:.1f} %.")
    if whole["by_person"] is None:
        lines.append("The interval takes trials for independent, which one person's are not.")
    return "\n".join(lines)


def _repeats(document: Document) -> str:
    if document["repeated"] is None:
        return ""
    again = f", {document['repeated']} presented again after an interruption"
    if not document["silent"]:
        return again
    return f"{again}; the speaker played nothing in {document['silent']} presentations"


def _patterns(document: Document) -> str:
    rows = []
    reactions = document["reaction"] or [None] * len(document["patterns"])
    for pattern, reaction in zip(document["patterns"], reactions, strict=True):
        row = [pattern["name"], _share(pattern)]
        if reaction is not None:
            low, middle, high = reaction["quartiles_s"]
            known = middle is not None
            row.append(f"{middle:.2f} ({low:.2f}-{high:.2f})" if known else "-")
            ends = (reaction["onset_plate_c"], reaction["plate_c"])
            row.append(", ".join("-" if end_c is None else f"{end_c:.1f}" for end_c in ends))
        rows.append(row)
    heads = ["pattern", "recognised"]
    if document["reaction"]:
        heads += ["reaction s, median (quartiles)", "plate at its begin, end, degC"]
    return "## Patterns\n\n" + _table(heads, rows)


def _axes(document: Document) -> str:
    lines = []
    for part in document["axes"]:
        each = ", ".join(
            f"{level['name']} {100 * level['share']:.1f} %"
            for level in part["each"]
            if level["share"] is not None
        )
        lines.append(f"- {part['factor']} alone: {_share(part)}: {each}")
    return "## One factor at a time\n\n" + "\n".join(lines)


def _bits(document: Document) -> str:
    found = document["information"]
    left = found["bits"] - found["bias"]
    return (
        f"Information transmitted: {found['bits']:.2f} of {found['most']:.2f} bits, of which about "
        f"{found['bias']:.2f} are bias of so few trials; {left:.2f} bits are what "
        f"{2**left:.1f} perfectly separate patterns carry."
    )


def _anova(document: Document) -> str:
    if document["anova_missing"]:
        return f"No repeated-measures ANOVA: {document['anova_missing']}."
    rows = [_effect(effect) for effect in document["anova"]]
    heads = ["effect", "F", "p", "p (Greenhouse-Geisser)", "partial eta squared"]
    undefined = any(effect["f"] is None for effect in document["anova"])
    note = "\n\n-: people do not differ in it at all, so F is not defined." if undefined else ""
    title = "## Two-way repeated-measures ANOVA of recognition\n\n"
    return title + _complete(document) + _table(heads, rows) + note + _ranks(document)


def _complete(document: Document) -> str:
    """Say who is left out of the tests within people."""
    left_out = document["incomplete"]
    if not left_out:
        return ""
    return (
        f"Of the {people(document['complete'])} who felt every pattern; without "
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
        + _table(heads, rows)
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


def _printed(document: Document) -> str:
    rows = []
    for each in document.get("printed_anova", ()):
        printed, two_way = each["as_printed"], each["two_way_df"]
        rows.append(
            [
                printed["name"],
                f"F({printed['df']}, {printed['df_error']}) = {printed['f']:.2f}",
                f"{each['printed_p']:g}",
                f"{printed['p']:.4f}",
                f"{printed['partial_eta2']:.3f}",
                f"F({two_way['df']}, {two_way['df_error']}): {two_way['p']:.2f}",
            ]
        )
    heads = ["effect", "printed, F recovered", "printed p", "p of that F", "partial eta squared"]
    heads.append("p on a 5 x 2 design's df")
    return "## The printed ANOVA, recomputed\n\n" + _table(heads, rows) if rows else ""


def _pairs(document: Document) -> str:
    pairs = document["pairwise"]
    if not pairs:
        return ""
    rows = [
        [
            f"{pair['first']} - {pair['second']}",
            f"{100 * pair['difference']:+.1f} %",
            f"{pair['p']:.4f}",
            f"{pair['p_holm']:.3f}",
        ]
        for pair in pairs[:PAIRS]
    ]
    below = sum(pair["p_holm"] < 0.05 for pair in pairs)
    return (
        f"## Pairs of patterns\n\n{document['pairwise_test']}; {len(pairs)} pairs, {below} with a "
        f"corrected p below 0.05. The first {len(rows)}:\n\n"
        + _table(["pair", "difference", "p", "p after Holm"], rows)
    )


def _notes(document: Document) -> str:
    notes = document.get("notes", ())
    return "## What does not fit\n\n" + "\n".join(f"- {note}" for note in notes) if notes else ""


def _share(each: Document) -> str:
    if each["share"] is None:
        return "no trial"
    text = f"{each['right']}/{each['of']} = {100 * each['share']:.1f} %"
    low, high = (100 * end for end in each["wilson"])
    text += f" (Wilson {low:.1f}-{high:.1f}"
    if each["by_person"] is not None:
        low, high = (100 * end for end in each["by_person"])
        text += f", by person {low:.1f}-{high:.1f}"
    return text + ")"


def _table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(heads)]
    lines += [["---"] * len(lines[0]), *(list(row) for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
