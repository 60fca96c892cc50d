"""The page of a report: one file of HTML with its style, its script and its pictures in it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from html import escape
from importlib import resources
from typing import Any

from ...errors import visible
from . import about, comparisons, judged, shown
from .told import Told, angle, n, table
from .typeset import typeset

POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'; "
    "form-action 'none'"
)
"""What the browser lets the page do: nothing beyond itself."""


SECTIONS: dict[str, tuple[str, Callable[[Told], str], tuple[str, ...]]] = {
    "what": ("What it is", about.what, ()),
    "lobe": ("Lobe", shown.lobe, ("lobes",)),
    "slices": ("Slices", shown.slices, ("slices", "half_difference")),
    "albedo": ("Albedo", shown.albedo, ("albedo", "delta")),
    "light": ("In the light", shown.light, ()),
    "laws": ("Laws", judged.laws, ("laws",)),
    "fits": ("Fits", judged.fits, ("fits",)),
    "colour": ("Colour", judged.colour, ("colour",)),
    "transmission": ("What becomes of light", judged.transmission, ("fate",)),
    "polarization": ("Polarization", judged.polarization, ("polarization",)),
    "provenance": ("Provenance and citation", about.provenance, ()),
    "reproduce": ("Do it yourself", about.reproduce, ()),
}
"""Name -> title and maker of the sections of a report about one material, and the parts that they tell of; without the
first of these a section is the reason why it is missing."""


def page(report: dict[str, Any], pictures: Sequence[dict[str, Any]]) -> str:
    """The page of a report and its pictures, material by material."""
    several = report["materials"]
    title = report["title"]
    body = overview(report, pictures) if len(several) > 1 else ""
    level = 2 if body else 1
    body += "".join(
        article(Told(one, own, f"m{k}"), level) for k, (one, own) in enumerate(zip(several, pictures, strict=True))
    )
    made = f"Made by gonio {escape(report['gonio'])} on {escape(report['date'][:16].replace('T', ', '))}."
    return visible(
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="generator" content="gonio {escape(report["gonio"])}">\n'
        f"<title>{escape(title)}</title>\n<style>\n{_file('page.css')}</style>\n</head>\n<body>\n"
        f'<div class="bar"><b>{escape(title)} <span>· gonio report</span></b>'
        f'<div class="units" role="group" aria-label="unit of angles">'
        f'<button type="button" value="deg" aria-pressed="true">degrees</button>'
        f'<button type="button" value="rad" aria-pressed="false">rad</button></div>'
        f'<button type="button" data-do="theme" aria-label="light or dark">◐</button>'
        f'<button type="button" data-do="print">Print</button></div>\n'
        f"<main>\n{body}\n<footer>{made} Angles are from the surface normal; f is the BRDF, radiance out over "
        f"irradiance in, without the cosine.</footer>\n</main>\n"
        f"<script>\n{_file('page.js')}</script>\n</body>\n</html>\n",
        keep="\n",
    )


def _file(name: str) -> str:
    return (resources.files(__package__) / name).read_text(encoding="utf-8")


def script_data(data: Any) -> str:
    """JSON in a script element, out of which no text of it gets."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json">{text}</script>'


def article(its: Told, level: int) -> str:
    """All sections of one material, behind a heading of this level, and what leads to them."""
    links, body = "", ""
    for name, (title, make, parts) in SECTIONS.items():
        if inner := its.told(make, *parts):
            has_spectrum = name == "colour" and (its.one["colour"] or {}).get("spectrum")
            title = "Spectrum and colour" if has_spectrum else title
            links += f'<a href="#{its.key}-{name}">{title}</a>'
            body += f'<section id="{its.key}-{name}"><h3>{title}</h3>{inner}</section>'
    head = f'{about.head(its, level)}<nav aria-label="parts">{links}</nav>'
    return f'<article class="material" id="{its.key}">{head}{body}</article>'


def overview(report: dict[str, Any], pictures: Sequence[dict[str, Any]]) -> str:
    """Several materials side by side: their numbers, plots and spheres."""
    several, rows = report["materials"], report["summary"]
    head = ["", *(f'<a href="#m{k}">{escape(one["name"])}</a>' for k, one in enumerate(several))]
    lines = [("kind", [typeset(row["title"]) for row in rows]), ("channels", [str(row["channels"]) for row in rows])]
    for theta in (0.0, 45.0, 75.0):
        if any(theta in row["albedo"] for row in rows):
            lines.append((f"albedo at {angle(theta)}", [n(row["albedo"].get(theta)) for row in rows]))
    lines.append(("albedo under a white sky", [n(row["white_sky"]) for row in rows]))
    peaks = [row["peak"] for row in rows]
    lines.append(("largest f [sr⁻¹] about 45°", [n(p["peak"]) if p else "–" for p in peaks]))
    lines.append(
        ("its full width at half", [angle(p["width"], 3) if p and p["width"] == p["width"] else "–" for p in peaks])
    )
    laws = []
    for row in rows:
        failed = f"<span class='why'>{escape(', '.join(row['failed']))}</span>" if row["failed"] else ""
        kind, sign = ("pass", "✓") if not row["failed"] else ("breaks", "◆") if row["lawful"] else ("fail", "✗")
        laws.append(
            f'<span class="verdict {kind}">{sign} {row["laws_held"]} of {row["laws"]}</span>{failed}'
            if row["laws"]
            else "–"
        )
    lines.append(("laws that hold", laws))
    lines.append(("most like", [escape(row["nearest"] or "–") for row in rows]))
    swatch = '<span class="swatch" style="background:{0}"></span> {0}'
    lines.append(("colour of the albedo", [swatch.format(row["colour"]) if row["colour"] else "–" for row in rows]))
    cells = table(head, [(name, *texts) for name, texts in lines], kind="side")
    spheres = ""
    for own, one in zip(pictures, several, strict=True):
        spheres += f'<p class="of-one">{escape(one["name"])}</p>'
        for x in own["spheres"][:3]:
            picture = f'<img src="{x["src"]}" alt="Sphere: {escape(x["caption"])}">' if "src" in x else ""
            spheres += f"<figure>{picture}<figcaption>{escape(x['caption'])}</figcaption></figure>"
    kind = ' class="long"' if len(report["title"]) > 36 else ""
    return (
        f'<article class="material"><header class="head"><div><h1{kind}>{escape(report["title"])}</h1>'
        f"<p>{len(several)} materials side by side, then each by itself.</p></div></header>"
        f'<section id="side"><h3>Side by side</h3>{cells}</section>'
        f'<section><h3>Overlaid</h3><div class="charts">{comparisons.of_several(several)}</div></section>'
        f'<section><h3>In the light</h3><div class="spheres">{spheres}</div></section></article>'
    )
