"""A material as one sees it: lobe, slices, albedo and spheres, as HTML."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from . import plots
from .told import Told, angle, n, reason, table


def lobe(its: Told) -> str:
    """The interactive lobe, and still ones."""
    stills = "".join(
        f'<figure><img src="{x["src"]}" alt="Lobe, light from {x["theta_i"]:g} degrees"><figcaption>light from '
        f"{angle(x['theta_i'])}</figcaption></figure>"
        for x in its.pictures["stills"]
    )
    unit = f", {escape(its.one['unit'])}" if its.one["unit"] else ""
    return (
        f"<p>f{unit} as the distance from the place that is lit, in every direction. Drag it, or turn it with the "
        f"arrow keys; + and − change the incidence.</p>"
        f'<div class="lobe"><canvas tabindex="0" role="img" aria-label="Lobe of {escape(its.one["name"])}; '
        f'arrow keys turn it"></canvas><div class="turns">'
        f'<label>incidence <input type="range" min="0" step="1"></label><label>radius <select>'
        f'<option value="log">log f</option><option value="linear">f</option></select></label>'
        f"<output></output></div>{its.pictures['lobes']}</div>"
        f'<div class="stills">{stills}</div>'
    )


def slices(its: Told) -> str:
    """f in planes, and by half and difference angle."""
    given, unit = its.one["slices"], its.one["unit"]
    through = given.get("through", [])
    drawn = [
        plots.of_polar(given["in_plane"], through, "f in the plane of incidence"),
        plots.of_slices(given["in_plane"], unit, "f in the plane of incidence"),
        plots.of_slices(given["across"], unit, "f across the plane of incidence", across=True),
    ]
    if through:
        drawn.append(plots.of_slices(through, unit, "f seen from the other side", across=True))
    if its.one["half_difference"]:
        drawn.append(plots.of_half_difference(its.one["half_difference"], unit))
    azimuth = given["azimuth_of_light"]
    of = f", {escape(unit)}" if unit else ""
    lead = f"f [sr⁻¹]{of}. Light arrives at azimuth {angle(azimuth)}; viewing angles are negative on its side."
    head = (
        "incidence",
        "mirror direction",
        "along the normal",
        "back to the light",
        "largest f",
        "at",
        "full width at half",
    )
    rows = [
        (angle(p["theta_i"]), n(p["mirror"]), n(p["normal"]), n(p["retro"]), n(p["peak"]),
         angle(p["peak_at"]) if np.isfinite(p["peak_at"]) else "–",
         angle(p["width"], 3) if np.isfinite(p["width"]) else "–")
        for p in its.one["peaks"]
    ]  # fmt: skip
    peaks = f"<h4>f [sr⁻¹] in the plane of incidence</h4>{table(head, rows, 1)}"
    return f'<p>{lead}</p><div class="charts">{"".join(drawn)}</div>{peaks}'


def albedo(its: Told) -> str:
    """Albedos with their uncertainty, and those of delta lobes."""
    given = its.one["albedo"]
    t = given["table"]
    shown, names = t["shown"], t["channels"]
    head = ["incidence", *(escape(names[c]) if len(names) > 1 else "albedo" for c in shown)]
    values = np.array(t["values"], float)
    u = {name: np.array(x, float) for name, x in t["u"].items()}
    if "total" in t:
        total = np.array(t["total"], float)
        cells = [[f"{n(values[k, c])} ± {n(total[k, c], 2)}" for c in shown] for k in range(len(values))]
        head += [f"u by {escape(name)}" for name in u]
        cells = [row + [n(x[k].max(), 2) for x in u.values()] for k, row in enumerate(cells)]
        lead = (
            f"± is one standard uncertainty: {escape(t['assumed'])}. How the errors of its values are correlated, "
            f"no file says."
        )
    else:
        head.append("error of the integral")
        error = u["integration"]
        cells = [[*(n(values[k, c], 5) for c in shown), f"{n(error[k], 1)}"] for k in range(len(values))]
        lead = f"The share of light from one direction that leaves again, by {escape(t['method'])}."
    rows = [[angle(theta), *row] for theta, row in zip(t["theta_i"], cells, strict=True)]
    rows.append(["white sky", *_white_sky(given["white_sky"], shown)])
    parts = [f'<p>{lead}</p><div class="charts">{plots.of_albedo(its.one)}<div>{table(head, rows, 1)}']
    if len(names) > len(shown):
        parts.append(f'<p class="of">{len(shown)} of {len(names)} channels; --json has all.</p>')
    if delta := its.one["delta"]:
        parts.append(_deltas(delta))
    return "".join(parts) + "</div></div>"


def _white_sky(white: dict[str, Any], shown: list[int]) -> list[str]:
    """The last row of the table of albedos."""
    if "total" not in white:
        return [*(n(white["values"][c]) for c in shown), f"≤ {n(white['u']['integration'])}"]
    cells = [f"{n(white['values'][c])} ± {n(white['total'][c], 2)}" for c in shown]
    return cells + [n(np.max(x), 2) for x in white["u"].values()]


def _deltas(delta: dict[str, Any]) -> str:
    columns = [name for name in ("reflected", "transmitted") if name in delta]
    rows = [
        [angle(theta), *(", ".join(n(x) for x in delta[name][k][:4]) for name in columns)]
        for k, theta in enumerate(delta["theta_i"])
    ]
    return f"<h4>Of it without scattering (delta lobes)</h4>{table(('incidence', *columns), rows, 1)}"


def light(its: Told) -> str:
    """The spheres."""
    figures = ""
    for x in its.pictures["spheres"]:
        if "src" in x:
            notes = "".join(f'<span class="why">{escape(text)}</span>' for text in x["notes"])
            caption = f"<figcaption>{escape(x['caption'])}{notes}</figcaption>"
            figures += f'<figure><img src="{x["src"]}" alt="Sphere: {escape(x["caption"])}">{caption}</figure>'
        else:
            figures += f"<figure>{reason(x['reason'])}<figcaption>{escape(x['caption'])}</figcaption></figure>"
    return f'<div class="spheres">{figures}</div>'
