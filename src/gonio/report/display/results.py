"""Results of functions: fits, verdicts of laws, plans, quoted numbers, texts of source."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np

from ...bridges.source import ShaderSource
from ...declared.contents import Contents, summary
from ...facts.compiled import Kernel
from ...fitting.result import Fit
from ...fitting.selection import Selection
from ...formula.spectrum import Spectrum
from ...integrals.fate import Fate
from ...laws import MapReport, Report
from ...reconstruction.planning.goniometer import Goniometer
from ...reconstruction.planning.plan import HEADER, Plan
from ...uncertainty.quoted import Quoted
from . import _sphere
from ._html import Cut, Raw, block, code, image, items, paragraph, sparkline, table, text
from ._things import html_of, short

MARKS = {"pass": "✓", "not significant": "≈", "breaks": "○", "FAIL": "✗"}
"""Signs of verdicts, for those who see no colours."""


@html_of.register
def _fit(found: Fit) -> Cut:
    rows = [(Raw(f"<code>{text(name)}</code>"), value, remark) for name, value, remark in found.rows()]
    classes = [
        (f"{c.low:.0f}° to {c.high:.0f}°", c.values, f"{c.rms:.1%}", f"{c.mean:+.1%}") for c in found.by_incidence()
    ]
    words = f"{found.used} values of {found.problem.samples.source}"
    sizes = f"loss {found.loss}, rms {found.rms:.4g}; AIC {found.aic:.6g}, BIC {found.bic:.6g}"
    state = "" if found.converged else "; it did not converge"
    parts = (
        code(found.title),
        paragraph(sizes + state, quiet=True),
        table(("parameter", "value ± standard error", ""), rows, "found.rows()"),
        table(("incidence", "values", "rms", "mean"), classes),
        items(found.notes),
    )
    picture = image(_sphere.picture(found.model), _sphere.SIZE, "a lit sphere of the model")
    return Cut("Fit", words, picture, parts)


@html_of.register
def _selection(selection: Selection) -> Cut:
    rows = []
    for candidate in selection.candidates:
        name = f"<b>{text(candidate.name)}</b>" if candidate is selection.best else text(candidate.name)
        of = candidate.fit
        told = (len(of.names), f"{candidate.foretold:.4g}", f"{of.bic:.6g}") if of else ("", "", candidate.error)
        rows.append((Raw(name), *told))
    head = ("model", "unknowns", "rms of rows left out", "BIC")
    return Cut("Selection", selection.source, parts=(table(head, rows), paragraph(selection.verdict)))


@html_of.register
def _report(report: Report) -> Cut:
    broken = sum(not law.passed for law in report.laws)
    words = "all laws hold" if not broken else f"{broken} of {len(report.laws)} laws broken"
    rows = [
        (
            Raw(f"{MARKS[law.verdict]} <b>{text(law.verdict)}</b>"),
            law.name,
            law.finding,
            law.place,
            "; ".join(filter(None, (law.why, law.significance, f"declared: {law.declared}" if law.declared else ""))),
        )
        for law in report.laws
    ]
    head = ("verdict", "law", "finding", "at [°]", "")
    return Cut("Report", words, parts=(code(report.material, 200), table(head, rows), items(report.notes)))


@html_of.register
def _map_report(report: MapReport) -> Cut:
    rows = []
    for name, broken in report.count().items():
        verdict = "pass" if not broken else "breaks" if name in report.declared else "FAIL"
        declared = f"declared: {report.declared[name]}" if name in report.declared else ""
        rows.append((Raw(f"{MARKS[verdict]} <b>{verdict}</b>"), name, f"{broken} values break it", declared))
    return Cut("MapReport", "", parts=(code(report.material, 200), table(("verdict", "law", "", ""), rows)))


@html_of.register
def _plan(plan: Plan) -> Cut:
    errors = [
        (Raw(f"<code>{text(name)}</code>"), f"{value:.4g}", f"{s:.2g}")
        for (name, s), value in zip(plan.stderr.items(), plan.values, strict=True)
    ]
    parts = (
        code(repr(plan.model), 300),
        table(HEADER, plan.rows(), "plan.rows()"),
        table(("parameter", "expected", "standard error"), errors),
        items(plan.notes),
    )
    return Cut("Plan", f"{len(plan)} pairs of directions, criterion {plan.criterion}", parts=parts)


@html_of.register
def _goniometer(arm: Goniometer) -> Cut:
    rows = []
    for f in fields(arm):
        value = getattr(arm, f.name)
        if isinstance(value, tuple):
            shown = f"{math.degrees(value[0]):g}° to {math.degrees(value[1]):g}°"
        elif isinstance(value, float):
            shown = f"{math.degrees(value):g}°"
        else:
            shown = "fixed" if value is None else str(value)
        rows.append((f.name, shown))
    return Cut("Goniometer", "", parts=(table(("", ""), rows),))


@html_of.register
def _quoted(quoted: Quoted) -> Cut:
    value = np.asarray(quoted.value)
    if value.size > 64:
        return Cut("Quoted", short(value), parts=(code(repr(quoted), 300),))
    texts, value = np.asarray(quoted.text()), np.atleast_1d(value)
    rows = [
        (
            ", ".join(map(str, at)) if value.size > 1 else "",
            str(texts if texts.ndim == 0 else texts.reshape(value.shape)[at]),
        )
        for at in np.ndindex(value.shape)
    ]
    return Cut("Quoted", "value ± standard uncertainty", parts=(table(("", ""), rows),))


@html_of.register
def _fate(fate: Fate) -> Cut:
    rows = [(name, short(np.asarray(getattr(fate, name)))) for name in fate._fields]
    return Cut("Fate", "shares of the light", parts=(table(("", ""), rows),))


@html_of.register
def _source(source: ShaderSource) -> Cut:
    functions = ", ".join(source.functions)
    parts: list[str] = [paragraph(functions, quiet=True), block(source.text)]
    if source.arguments:
        rows = [(Raw(f"<code>{text(a.name)}</code>"), a.path, short(np.asarray(a.value))) for a in source.arguments]
        parts.insert(1, table(("argument", "parameter", "value"), rows))
    tables = f", {len(source.tables)} tables" if source.tables else ""
    return Cut(source.name, f"{source.language}, {len(source.text.splitlines())} lines{tables}", parts=tuple(parts))


@html_of.register
def _kernel(kernel: Kernel) -> Cut:
    return Cut("Kernel", f"of {', '.join(kernel.inputs[:12])}", parts=(block(kernel.source),))


@html_of.register
def _spectrum(spectrum: Spectrum) -> Cut:
    with np.errstate(all="ignore"):
        values: Any = np.asarray(getattr(spectrum, "values", ()))
    drawn = sparkline(np.real(values).ravel().tolist()) if values.ndim == 1 and values.size > 1 else ""
    return Cut(type(spectrum).__name__, parts=(drawn, code(repr(spectrum), 400)))


@html_of.register
def _contents(contents: Contents) -> Cut:
    rows = [(Raw(f"<code>{text(name)}</code>"), summary(thing)) for name, thing in contents.items()]
    lines = "".join(table(("", ""), rows[k : k + 24]) for k in range(0, len(rows), 24))
    return Cut("Contents", f"{len(rows)} names", parts=(f'<div style="max-height:30em;overflow:auto">{lines}</div>',))
