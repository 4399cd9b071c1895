"""Writes the report of a study: pictures, tables, and one page with everything in it."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hapticvlm import documents
from hapticvlm.errors import installing
from hapticvlm.palette import FIGURE
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.report import confusion, plots, results
from hapticvlm_studio.report.evaluate import Document, evaluate, evaluate_paper
from hapticvlm_studio.report.statistics import Share
from hapticvlm_studio.report.text import CONFUSION, PICTURES, people, text_of

_STYLE = """
:root { color-scheme: light dark; }
body { font: 1rem/1.55 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem;
  color: light-dark(#15202a, #e9eff3); background: light-dark(#fff, #0f1418); }
h1 { line-height: 1.2; }
h2 { margin-top: 2.2rem; border-bottom: 1px solid light-dark(#d3dbe1, #323f48); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .3rem .8rem .3rem 0; vertical-align: top;
  border-bottom: 1px solid light-dark(#d3dbe1, #323f48); }
img { max-width: 100%; height: auto; background: #fff; border-radius: .3rem; }
@media print { body { margin: 0; } h2, tr { break-inside: avoid; } }
"""
# The page is opened from mail attachments and shared drives, and parts of it come from the study's
# file. This policy lets a browser load nothing and run nothing, whatever the text contains.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def report(folder: Path, out: Path | None, *, as_json: bool, decimal_comma: bool = False) -> str:
    """Evaluate the study in `folder`, write the files and return the text, or the JSON.

    Files go to `out`, or to the folder `report` of the study; `decimal_comma` is of its CSV files.
    Raises StudyError and OSError.
    """
    study = results.read(folder)
    if not study.counted:
        raise StudyError(f"{folder}: no trial is answered yet")
    document = evaluate(study)
    out = folder / "report" if out is None else out
    with documents.naming(out):
        out.mkdir(parents=True, exist_ok=True)
        results.write_csv(out / "trials.csv", study, decimal_comma=decimal_comma)
        if study.form.question or len(study.form.languages) > 1:
            people_file = out / "participants.csv"
            results.write_people(people_file, study, decimal_comma=decimal_comma)
        _draw(out, document, [np.array(each["all_s"]) for each in document["reaction"]])
        return _finish(out, document, as_json=as_json)


def report_paper(out: Path | None, *, as_json: bool) -> str:
    """Evaluate the paper's counts and return the text, or the JSON; write files only to `out`."""
    document = evaluate_paper()
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        _draw(out, document, None)
    return _finish(out, document, as_json=as_json)


def _draw(out: Path, document: Document, times: Sequence[Any] | None) -> None:
    """Draw the pictures; without matplotlib the report says so and has its first one only."""
    heading = f"{people(document['participants'])}, {document['answered']} trials"
    if document["simulated"]:
        heading += "; SIMULATED devices"
    elif document["heard"]:
        heading += "; HEARD, not felt"
    whole = (document["labels"], np.array(document["counts"]))
    parts = [
        (f"{part['factor']} alone", (part["levels"], np.array(part["counts"])))
        for part in document["axes"]
    ]
    documents.replace_file(out / CONFUSION, confusion.svg(heading, whole, parts))
    try:
        import matplotlib as mpl
    except ModuleNotFoundError:
        document["pictures_missing"] = f"they need matplotlib: `{installing('matplotlib')}`"
        for name in PICTURES.keys() - {CONFUSION}:  # of an earlier evaluation
            (out / name).unlink(missing_ok=True)
        return
    with mpl.rc_context(dict(FIGURE)):
        patterns = zip(document["labels"], document["patterns"], strict=True)
        shares = [(label, _share(each)) for label, each in patterns]
        plots.recognition(out / "recognition.png", heading, shares, times, document["chance"])
        if rated := [each for each in document["ratings"] if each["of"]]:
            plots.ratings(out / "ratings.png", heading, rated)


def _share(each: Document) -> Share:
    return Share(each["right"], each["of"], each["share"], each["wilson"], each["by_person"])


def _finish(out: Path | None, document: Document, *, as_json: bool) -> str:
    summary = text_of(document)
    data = json.dumps(document)
    if out is not None:
        markdown = text_of(document, out)
        documents.replace_file(out / "report.md", markdown + "\n")
        documents.replace_file(out / "report.html", page(markdown, out))
        documents.replace_file(out / "report.json", data + "\n")
        summary += (
            f"\n\nfiles in {out}; {out / 'report.html'} is one file that can be sent to others"
        )
    return data if as_json else summary


def page(markdown: str, folder: Path) -> str:
    """Return an HTML page of this text with its pictures inside, PNG and SVG files of `folder`.

    The page loads no other file. HTML within the text is shown as text: titles and answers come
    from the study's file. Raises OSError.
    """
    from markdown_it import MarkdownIt

    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(markdown)
    # Pictures are replaced while the text is still tokens: a path inside rendered HTML could not be
    # distinguished from the same characters in the study's own texts.
    for token in tokens:
        for child in token.children or ():
            if child.type == "image":
                child.attrs["src"] = _inside(folder / str(child.attrs["src"]))
    body = reader.renderer.render(tokens, reader.options, {})
    # A wide table scrolls inside its own box, which the keyboard can reach, and not the whole page.
    body = body.replace("<table>", '<div class="wide" tabindex="0"><table>')
    body = body.replace("</table>", "</table></div>")
    title = html.escape(markdown.lstrip("# ").partition("\n")[0])
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        f"<title>{title}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n<main>\n{body}"
        "</main>\n</body>\n</html>\n"
    )


def _inside(picture: Path) -> str:
    kind = "svg+xml" if picture.suffix == ".svg" else "png"
    return f"data:image/{kind};base64," + base64.b64encode(picture.read_bytes()).decode()
