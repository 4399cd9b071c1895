"""The report of a study in words: Markdown out of the document of numbers. Computes nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hapticvlm_studio.report.plots import LEAST_BOXED
from hapticvlm_studio.report.text_of_tests import anova, pairs, printed, table

Document = dict[str, Any]
PICTURES = {
    "recognition": "Share recognised of each pattern, with 95 % intervals.",
    "confusion": "Confusion matrices: how often each pattern presented was answered as each.",
    "ratings": "Mean rating of each pattern with its 95 % interval by person.",
    "anova": "Each printed F as p on the printed degrees of freedom and on those of the design.",
}
_BIAS_LIMIT = 0.25  # of the bits: with more the correction is no figure any more


def text_of(document: Document, pictures: Path | None = None) -> str:
    """Write the report; with those of its pictures that are in a folder."""
    parts = [_head(document), _claims(document), _shown(pictures, "recognition", "confusion")]
    parts += [_patterns(document), _axes(document), _bits(document)]
    parts += [anova(document), printed(document), _shown(pictures, "anova"), pairs(document)]
    parts += [_ratings(document), _shown(pictures, "ratings"), _people(document), _notes(document)]
    return "\n\n".join(part for part in parts if part)


def people(count: int) -> str:
    """Return how many took part."""
    return f"{count} participant{'' if count == 1 else 's'}"


def _head(document: Document) -> str:
    lines = [f"# {document['title']}", ""]
    if document["simulated"]:
        lines += [
            "**Devices were SIMULATED: nobody felt anything, so this says nothing of people.**"
        ]
        lines += [""]
    if document["heard"]:
        lines += ["**A pilot: the vibration was heard from the page, not felt.**", ""]
    lines.append(
        f"{people(document['participants'])}, {document['answered']} of "
        f"{document['planned']} trials answered, {document['excluded']} left out because a device "
        f"did not present its pattern{_repeats(document)}."
    )
    whole = document["recognition"]
    chance = document["chance"]
    lines.append(f"RecogniserResult: {_share(whole)}; chance {100 * chance:.1f} %.")
    if whole["by_person"] is None:
        lines.append("The interval takes trials for independent, which one person's are not.")
    return "\n".join(lines)


def _claims(document: Document) -> str:
    may, may_not = (
        "\n".join(f"- {claim}" for claim in document[name]) for name in ("may", "may_not")
    )
    return f"## What may be claimed\n\n{may}\n\n## What may not\n\n{may_not}"


def _shown(folder: Path | None, *names: str) -> str:
    """Include those pictures that the folder has."""
    if folder is None:
        return ""
    there = [name for name in names if (folder / f"{name}.png").exists()]
    return "\n\n".join(f"![{PICTURES[name]}]({name}.png)" for name in there)


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
            row.append(_reaction(reaction["all_s"], reaction["quartiles_s"]))
            ends = (reaction["onset_plate_c"], reaction["plate_c"])
            row.append(", ".join("-" if end_c is None else f"{end_c:.1f}" for end_c in ends))
        rows.append(row)
    heads = ["pattern", "recognised"]
    if document["reaction"]:
        heads += ["reaction s, median (quartiles)", "plate at its begin, end, degC"]
    key = f"\n\n{document['key']}." if "key" in document else ""
    return "## Patterns\n\n" + table(heads, rows) + key


def _reaction(times: Sequence[float], quartiles: Sequence[float | None]) -> str:
    """Return the median, with quartiles where there are enough answers to have some."""
    low, middle, high = quartiles
    if middle is None:
        return "-"
    if len(times) < LEAST_BOXED:
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
    found = document["information"]
    left = found["bits"] - found["bias"]
    if found["bias"] > _BIAS_LIMIT * found["bits"]:
        return (
            f"Information transmitted cannot be told from so few trials: of {found['bits']:.2f} "
            f"bits counted {found['bias']:.2f} would be bias."
        )
    return (
        f"Information transmitted: {found['bits']:.2f} of {found['most']:.2f} bits, of which about "
        f"{found['bias']:.2f} are bias of so few trials; {left:.2f} bits are what "
        f"{2**left:.1f} perfectly separate patterns carry."
    )


def _ratings(document: Document) -> str:
    rated = [rating for rating in document["ratings"] if rating["of"]]
    if not rated:
        return ""
    heads = ["pattern", *(f"{rating['name']}, 1 to {rating['steps']}" for rating in rated)]
    names = [*document["names"], "all"]
    rows = []
    for at, name in enumerate(names):
        each = [rating if name == "all" else rating["patterns"][at] for rating in rated]
        rows.append([name, *(_mean(rating) for rating in each)])
    return (
        "## Ratings\n\nMean of people's means, 95 % interval by person (Student's t), number of "
        "people:\n\n" + table(heads, rows)
    )


def _mean(each: Document) -> str:
    if each["mean"] is None:
        return "-"
    ends = each["by_person"]
    interval = "no interval of one" if ends is None else f"{ends[0]:.1f} to {ends[1]:.1f}"
    return f"{each['mean']:.1f} ({interval}; {each['of']})"


def _people(document: Document) -> str:
    lines = []
    for about in document["people"]:
        text = f"- {about['name']}: {about['answers']} of {document['participants']} answered"
        if "mean" in about:
            low, high = about["ends"]
            spread = "" if about["sd"] is None else f", standard deviation {about['sd']:.1f}"
            text += f"; mean {about['mean']:.1f}{spread}, from {low:g} to {high:g}"
        if "counts" in about:
            text += "; " + ", ".join(f"{name} {n}" for name, n in about["counts"].items())
        if about["kind"] == "text":
            text += "; the words stand in participants.csv alone"
        lines.append(text)
    return "## Participants\n\n" + "\n".join(lines) if lines else ""


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
