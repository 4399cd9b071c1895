"""Writes the report of a study as Markdown from the document of numbers. Computes nothing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from hapticvlm_studio.report.plots import MIN_QUARTILES

Document = dict[str, Any]
CONFUSION = "confusion.svg"
PICTURES = {
    CONFUSION: "Confusion matrices: how often each pattern presented was answered as each.",
    "recognition.png": "Share recognised of each pattern, with 95 % intervals.",
    "ratings.png": "Mean rating of each pattern with its 95 % interval by person.",
}
# Of the bits. Miller and Madow's correction is the first term of a series; where it is large, the
# terms left out are large too, and the corrected figure would mean nothing.
_BIAS_LIMIT = 0.25
_MAX_PAIRS = 10


def text_of(document: Document, pictures: Path | None = None) -> str:
    """Return the report; with those of its pictures that exist in the folder `pictures`."""
    # What may be claimed comes before the tables, since few readers go on to the end.
    parts = [_head(document), _claims(document), _shown(pictures, CONFUSION, "recognition.png")]
    parts += [_patterns(document), _axes(document), _bits(document)]
    parts += [_anova(document), _printed(document), _pairs(document)]
    parts += [
        _ratings(document),
        _shown(pictures, "ratings.png"),
        _people(document),
        _notes(document),
        f"No other pictures: {document['pictures_missing']}."
        if "pictures_missing" in document
        else "",
    ]
    return "\n\n".join(part for part in parts if part)


def people(count: int) -> str:
    """Return the number of participants in words."""
    return f"{count} participant{'' if count == 1 else 's'}"


def _head(document: Document) -> str:
    lines = [f"# {document['title']}", ""]
    if document["simulated"]:
        lines += [
            "**Devices were SIMULATED: nobody felt anything, so this says nothing about people.**"
        ]
        lines += [""]
    if document["heard"]:
        lines += ["**A pilot: the vibration was heard from the page, not felt.**", ""]
    lines.append(
        f"{people(document['participants'])}, {document['answered']} of "
        f"{document['planned']} trials answered, {document['excluded']} left out because a device "
        f"did not present its pattern{_repeats(document)}."
    )
    # The first figure that a reader takes away gets its caveat in the next line.
    whole = document["recognition"]
    chance = document["chance"]
    lines.append(f"Recognition: {_share(whole)}; chance {100 * chance:.1f} %.")
    if whole["by_person"] is None:
        lines.append(
            "The interval assumes independent trials, which the trials of one person are not."
        )
    return "\n".join(lines)


def _claims(document: Document) -> str:
    may, may_not = (
        "\n".join(f"- {claim}" for claim in document[name]) for name in ("may", "may_not")
    )
    return f"## What may be claimed\n\n{may}\n\n## What may not be claimed\n\n{may_not}"


def _shown(folder: Path | None, *names: str) -> str:
    """Return links to those pictures that exist in the folder."""
    if folder is None:
        return ""
    existing = [name for name in names if (folder / name).exists()]
    return "\n\n".join(f"![{PICTURES[name]}]({name})" for name in existing)


def _repeats(document: Document) -> str:
    if document["repeated"] is None:
        return ""
    repeated = f", {document['repeated']} presented again after an interruption"
    if not document["silent"]:
        return repeated
    return f"{repeated}; the speaker played nothing in {document['silent']} presentations"


def _patterns(document: Document) -> str:
    rows = []
    reactions = document["reaction"] or [None] * len(document["patterns"])
    for pattern, reaction in zip(document["patterns"], reactions, strict=True):
        row = [pattern["name"], _share(pattern)]
        if reaction is not None:
            row.append(_reaction(reaction["all_s"], reaction["quartiles_s"]))
            ends = (reaction["onset_plate_c"], reaction["plate_c"])
            row.append(", ".join("-" if end_c is None else f"{end_c:.1f}" for end_c in ends))
        rows.append(row)
    header = ["pattern", "recognised"]
    if document["reaction"]:
        header += ["reaction s, median (quartiles)", "plate at begin, end, degC"]
    key = f"\n\n{document['key']}." if "key" in document else ""
    return "## Patterns\n\n" + _table(header, rows) + key


def _reaction(times: Sequence[float], quartiles: Sequence[float | None]) -> str:
    """Return the median, with quartiles where there are enough answers."""
    low, middle, high = quartiles
    if middle is None:
        return "-"
    if len(times) < MIN_QUARTILES:
        return f"{middle:.2f} of {len(times)}"
    return f"{middle:.2f} ({low:.2f}-{high:.2f})"


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
    information = document["information"]
    bits, bias = information["bits"], information["bias"]
    if bias > _BIAS_LIMIT * bits:
        return (
            f"Information transmitted cannot be estimated from so few trials: they count "
            f"{bits:.2f} bits, and their bias is about {bias:.2f}."
        )
    return (
        f"Information transmitted: {bits:.2f} of {information['most']:.2f} bits, of which about "
        f"{bias:.2f} are bias of so few trials. The remaining {bits - bias:.2f} bits are what "
        f"{2 ** (bits - bias):.1f} perfectly distinct patterns carry."
    )


def _anova(document: Document) -> str:
    """Return the tests within people."""
    if document["anova_missing"]:
        missing = f"No repeated-measures ANOVA: {document['anova_missing']}."
        return missing + _ranks(document)
    rows = [_effect(effect) for effect in document["anova"]]
    header = ["effect", "F", "p", "p (Greenhouse-Geisser)", "partial eta squared"]
    undefined = any(effect["f"] is None for effect in document["anova"])
    note = (
        "\n\n-: people do not differ in this effect at all, so F is not defined."
        if undefined
        else ""
    )
    title = "## Two-way repeated-measures ANOVA of recognition\n\n"
    return title + _complete(document) + _table(header, rows) + note + _ranks(document)


def _complete(document: Document) -> str:
    """Return who is left out of the tests within people, and why."""
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
            test["name"],
            f"chi2({test['df']}) = {test['chi2']:.2f}",
            f"{test['p']:.4f}",
            f"{test['w']:.2f}",
        ]
        for test in document["friedman"]
    ]
    if not rows:
        return ""
    header = ["Friedman's test, by ranks", "chi2", "p", "Kendall's W"]
    return (
        "\n\nShares of a few trials near the ceiling are not normally distributed; ranks do not "
        "assume it:\n\n" + _table(header, rows)
    )


def _effect(effect: Document) -> list[str]:
    name = effect["name"]
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
    """Return the ANOVA that the paper prints, recomputed."""
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
    header = ["effect", "printed, F recovered", "printed p", "p of that F", "partial eta squared"]
    header.append("p on a 5 x 2 design's df")
    return "## The printed ANOVA, recomputed\n\n" + _table(header, rows) if rows else ""


def _pairs(document: Document) -> str:
    """Return the tests of every two patterns, the smallest p first."""
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
        for pair in pairs[:_MAX_PAIRS]
    ]
    below = sum(pair["p_holm"] < 0.05 for pair in pairs)
    return (
        f"## Pairs of patterns\n\n{document['pairwise_test']}; {len(pairs)} pairs, {below} with a "
        f"corrected p below 0.05. The first {len(rows)}:\n\n"
        + _table(["pair", "difference", "p", "p after Holm"], rows)
    )


def _table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a Markdown table."""
    lines = [list(header)]
    lines += [["---"] * len(lines[0]), *(list(row) for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _ratings(document: Document) -> str:
    rated = [rating for rating in document["ratings"] if rating["of"]]
    if not rated:
        return ""
    header = ["pattern", *(f"{rating['name']}, 1 to {rating['steps']}" for rating in rated)]
    names = [*document["names"], "all"]
    rows = []
    for at, name in enumerate(names):
        each = [rating if name == "all" else rating["patterns"][at] for rating in rated]
        rows.append([name, *(_mean(rating) for rating in each)])
    return (
        "## Ratings\n\nMean of people's means, 95 % interval by person (Student's t), number of "
        "people:\n\n" + _table(header, rows)
    )


def _mean(each: Document) -> str:
    if each["mean"] is None:
        return "-"
    ends = each["by_person"]
    interval = "no interval of one person" if ends is None else f"{ends[0]:.1f} to {ends[1]:.1f}"
    return f"{each['mean']:.1f} ({interval}; {each['of']})"


def _people(document: Document) -> str:
    lines = []
    for answers in document["people"]:
        line = f"- {answers['name']}: {answers['answers']} of {document['participants']} answered"
        if "mean" in answers:
            low, high = answers["ends"]
            spread = "" if answers["sd"] is None else f", standard deviation {answers['sd']:.1f}"
            line += f"; mean {answers['mean']:.1f}{spread}, from {low:g} to {high:g}"
        if "counts" in answers:
            line += "; " + ", ".join(f"{name} {n}" for name, n in answers["counts"].items())
        if answers["kind"] == "text":
            line += "; the words are in participants.csv only"
        lines.append(line)
    return "## Participants\n\n" + "\n".join(lines) if lines else ""


def _notes(document: Document) -> str:
    notes = document.get("notes", ())
    return "## What does not fit\n\n" + "\n".join(f"- {note}" for note in notes) if notes else ""


def _share(each: Document) -> str:
    if each["share"] is None:
        return "no trials"
    share = f"{each['right']}/{each['of']} = {100 * each['share']:.1f} %"
    low, high = (100 * end for end in each["wilson"])
    share += f" (Wilson {low:.1f}-{high:.1f}"
    if each["by_person"] is not None:
        low, high = (100 * end for end in each["by_person"])
        share += f", by person {low:.1f}-{high:.1f}"
    return share + ")"
