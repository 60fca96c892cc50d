"""A material as it is judged: laws, fits, colours, shares of light, polarization, as HTML."""

from __future__ import annotations

from html import escape

from . import comparisons, plots
from .told import Told, angle, n, reason, table
from .typeset import typeset

VERDICTS = {
    "pass": ("pass", "✓ holds"),
    "not significant": ("pass", "≈ not significant"),
    "breaks": ("breaks", "◆ breaks, as declared"),
    "FAIL": ("fail", "✗ fails"),
}
"""Verdict -> class, and the symbol and words that say it without colour."""


def laws(its: Told) -> str:
    """The verdicts."""
    given = its.one["laws"]
    rows = []
    for law in given["laws"]:
        kind, words = VERDICTS[law["verdict"]]
        where = ", ".join(f"{typeset(name)} {angle(x)}" for name, x in law["where"].items())
        why = [law["why"], law["significance"], f"declared: {law['declared']}" if law["declared"] else ""]
        told = "".join(f'<span class="why">{escape(text)}</span>' for text in why if text)
        rows.append((
            f'{escape(law["name"])}<span class="why">{typeset(law["statement"])}</span>',
            f'<span class="verdict {kind}">{words}</span>', f"{typeset(law['finding'])}{told}", where,
        ))  # fmt: skip
    notes = "".join(f'<p class="note">{typeset(text)}</p>' for text in given["notes"])
    lead = "Each law is measured, and the number held to its tolerance."
    cells = table(("law", "verdict", "number and tolerance", "where"), rows, kind="laws")
    return f"<p>{lead}</p>{cells}{notes}"


def fits(its: Told) -> str:
    """The nearest materials and models."""
    given = its.one["fits"]
    lead = (
        "How near models come to the measurement, and which built-in materials are most like it."
        if given["measured"]
        else "A formula needs no fit: this is how near simpler models, and other built-in materials, come to it."
    )
    parts = [f"<p>{lead}</p>"]
    if given["exact"]:
        form = f"<code>{escape(given['exact'][0])}</code>"
        parts.append(f'<p class="note">The material is of the form {form}, which fits it exactly.</p>')
    tables = []
    if given["models"]:
        best = given["models"][0]
        weighed = best["chi2_per_free"] is not None
        head = ("model", "fitted", "χ² / degrees of freedom" if weighed else "rms of f cos θᵢ [sr⁻¹]")
        rows = [
            (
                f"<code>{escape(x['model'])}</code>",
                f"<code>{escape(x['found'])}</code>",
                n(x["chi2_per_free"] if weighed else x["rms"], 3),
            )
            for x in given["models"]
        ]
        parts.append(table(head, rows))
        parts.append(
            f'<div class="charts">{comparisons.of_fit(given["residuals"], best["found"], its.one["unit"])}</div>'
        )
        cells = [(escape(p["name"]), escape(p["value"]), escape(p["remark"])) for p in best["parameters"]]
        tables.append("<h4>Numbers of the best fit</h4>" + table(("parameter", "value ± standard error", ""), cells))
        by_angle = [
            (
                f"{angle(c['low'])} to {angle(c['high'])}",
                str(c["values"]),
                f"{100.0 * c['rms']:.2g} %",
                f"{100.0 * c['mean']:+.2g} %",
            )
            for c in best["by_incidence"]
        ]
        tables.append(
            "<h4>Its residuals by incidence</h4>" + table(("incidence", "values", "rms", "mean"), by_angle, 1)
        )
    if given["nearest"]:
        rows = [(escape(x["name"]), n(x["distance"], 3), escape(x["what"])) for x in given["nearest"]]
        head = ("built-in material", "distance", "")
        of = '<p class="of">Distance: root mean square difference of ln(1 + f cos θᵢ).</p>'
        tables.append("<h4>Nearest built-in materials</h4>" + table(head, rows) + of)
    parts.append(f'<div class="tables">{"".join(f"<div>{each}</div>" for each in tables)}</div>')
    if given["models"]:
        parts += [f'<p class="note">{escape(text)}</p>' for text in given["models"][0]["notes"]]
    parts += [reason(text) for text in given["reasons"]]
    return "".join(parts)


def colour(its: Told) -> str:
    """Patches and the spectrum."""
    given = its.one["colour"]
    parts = []
    if given["patches"]:
        items = []
        for x in given["patches"]:
            lab = ", ".join(f"{v:.1f}" for v in x["lab"])
            beyond = "" if x["in_gamut"] else "<br>beyond sRGB: clipped"
            head = f'<i style="background:{x["hex"]}"></i>light from {angle(x["theta_i"])}'
            items.append(f"<li>{head}<br><code>{x['hex']}</code><br>L*a*b* {lab}{beyond}</li>")
        parts.append("<p>The colour of the albedo in daylight (D65, CIE 1931), as sRGB and CIELAB.</p>")
        parts.append(f'<ul class="patches">{"".join(items)}</ul>')
    if given["spectrum"]:
        parts.append(f'<div class="charts">{plots.of_spectrum(given["spectrum"])}</div>')
    return "".join(parts)


def transmission(its: Told) -> str:
    """Shares of light, where it passes."""
    given = its.one["fate"]
    wanted = [k for k, theta in enumerate(given["theta_i"]) if theta in (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)]
    names = ("reflected", "transmitted", "absorbed")
    rows = [[angle(given["theta_i"][k]), *(n(given[name][k]) for name in names)] for k in wanted]
    cells = table(("incidence", *names), rows, 1)
    drawn = plots.of_fate(given, its.one["unit"])
    return f'<div class="charts">{drawn}<div>{cells}</div></div>'


def polarization(its: Told) -> str:
    """What becomes of the polarization of light."""
    given = its.one["polarization"]
    drawn = plots.of_polarization(given["degree"]) if given["degree"] else ""
    matrices = ""
    for x in given["mirror"]:
        if x["theta_i"] in (45.0, 75.0):
            body = "".join(
                "<tr>" + "".join(f"<td>{n(v if abs(v) > 5e-7 else 0.0, 3)}</td>" for v in row) + "</tr>"
                for row in x["matrix"]
            )
            cells = f'<div class="wide"><table class="matrix"><tbody>{body}</tbody></table></div>'
            matrices += f"<h4>Light from {angle(x['theta_i'])}</h4>{cells}"
    lead = (
        "Mueller matrices at the mirror direction, over their first element; axes: s and p of each direction, "
        "Stokes I, Q, U, V with Q = I<sub>s</sub> − I<sub>p</sub>."
    )
    beside = f'<div><p class="of">{lead}</p>{matrices}</div>'
    return f'<div class="charts">{drawn}{beside}</div>'
