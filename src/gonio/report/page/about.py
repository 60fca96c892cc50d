"""What a material is, where its numbers come from, and how they are had again: as HTML."""

from __future__ import annotations

import re
from html import escape
from typing import Any

import numpy as np

from ...conversion.conversion import percent
from .drawing import angle
from .told import Told, copied, n, table
from .typeset import typeset


class About(Told):
    """Head, What it is, Provenance, Do it yourself."""

    def head(self, level: int) -> str:
        """The name, a sphere, and the numbers that say most."""
        one = self.one
        cards: list[tuple[str, str]] = []
        if one["albedo"]:
            table_ = one["albedo"]["table"]
            for theta in (0.0, 45.0):
                k = int(np.abs(np.array(table_["theta_i"]) - theta).argmin())
                mean = float(np.mean(table_["values"][k]))
                cards.append((f"albedo at {angle(table_['theta_i'][k])}", n(mean, 3)))
        middle = min(one["peaks"], key=lambda p: abs(p["theta_i"] - 45.0), default=None)
        if middle is not None and np.isfinite(middle["peak"]):
            cards.append((f"largest f, light from {angle(middle['theta_i'])}", f"{n(middle['peak'], 3)} sr⁻¹"))
        if one["laws"]:
            laws = one["laws"]["laws"]
            held = sum(law["passed"] for law in laws)
            kind = "pass" if one["laws"]["passed"] else "breaks" if one["laws"]["lawful"] else "fail"
            cards.append(("laws that hold", f'<span class="verdict {kind}">{held} of {len(laws)}</span>'))
        if one["colour"] and one["colour"]["patches"]:
            code = one["colour"]["patches"][0]["hex"]
            cards.append(("colour of the albedo", f'<span class="swatch" style="background:{code}"></span>{code}'))
        kind = ' class="long"' if len(one["name"]) > 36 else ""
        sphere = next((x for x in [*self.pictures["spheres"][1:2], *self.pictures["spheres"]] if "src" in x), None)
        picture = f'<img src="{sphere["src"]}" alt="A lit sphere: {escape(sphere["caption"])}">' if sphere else ""
        items = "".join(f"<li><small>{small}</small><strong>{strong}</strong></li>" for small, strong in cards)
        return (
            f'<header class="head"><div><h{level}{kind}>{escape(one["name"])}</h{level}><p>{typeset(one["title"])}</p>'
            f'<ul class="cards">{items}</ul></div>{picture}</header>'
        )

    def what(self) -> str:
        """Formula, parameters, what a file holds."""
        f, one = self.facts, self.one
        rows = [("kind", typeset(one["title"]))]
        if "expression" in f:
            rows.append(("expression", f"<code>{escape(f['expression'])}</code>"))
        rows += self._file_rows() if "format" in f else []
        names = f["channel_names"]
        listed = (
            ""
            if names is None
            else ": "
            + (
                ", ".join(map(str, names))
                if len(names) <= 8
                else f"{names[0]} to {names[-1]}{'' if isinstance(names[0], str) else ' nm'}"
            )
        )
        rows.append(("channels", escape(f"{f['channels']}{listed}")))
        rows.append(
            ("turned about the normal", "the same (isotropic)" if one["isotropic"] else "differs (anisotropic)")
        )
        if "fluorescence" in f:
            rows.append(("fluorescence", escape(f["fluorescence"])))
        parts = [table(("", ""), rows, kind="facts")]
        if f["parameters"]:
            cells = [
                (f"<code>{escape(path)}</code>", self._value(p["value"]), self._unit(p["unit"]),
                 f"{n(p['low'], 6)} to {n(p['high'], 6)}", escape(p["doc"]))
                for path, p in f["parameters"].items()
            ]  # fmt: skip
            parts.append("<h4>Parameters</h4>" + table(("parameter", "value", "unit", "bounds", "meaning"), cells))
        if f["options"]:
            words = [
                (
                    f"<code>{escape(path)}</code>",
                    escape(str(o["value"])),
                    escape(", ".join(o["choices"])),
                    escape(o["doc"]),
                )
                for path, o in f["options"].items()
            ]
            parts.append("<h4>Options</h4>" + table(("option", "value", "choices", "meaning"), words))
        parts.append("<h4>Formula</h4>" if "expression" in f else "<h4>How values come from the file</h4>")
        for told in one["formulas"]:
            source = f" Source: {typeset(told['source'])}" if told["source"] else ""
            parts.append(f'<div class="formula"><b>{escape(told["class"])}</b>  {typeset(told["formula"])}</div>')
            parts.append(f'<p class="of">{typeset(told["units"])}{source}</p>')
        return "".join(parts)

    def _value(self, value: Any) -> str:
        values = np.atleast_1d(np.asarray(value, dtype=object)).ravel().tolist()
        shown = [n(x, 6) if isinstance(x, (int, float)) else escape(str(x)) for x in values[:8]]
        return ", ".join(shown) + (f" … ({len(values)} numbers)" if len(values) > 8 else "")

    def _unit(self, unit: str) -> str:
        return "" if unit == "1" else typeset(re.sub(r"(?<=[a-z])(-\d)", r"^\1", unit))

    def _file_rows(self) -> list[tuple[str, str]]:
        f = self.facts
        rows = [("format", escape(f["format"])), ("quantity in the file", escape(str(f["quantity"])))]
        if f["parameterisation"]:
            rows.append(("grid by", escape(str(f["parameterisation"]).replace("_", " "))))
        for name, axis in f["axes"].items():
            nodes = f"{axis['nodes']} nodes, {angle(axis['low'])} to {angle(axis['high'])}"
            step = "" if axis["step"] is None or axis["nodes"] < 2 else f", every {angle(axis['step'])}"
            rows.append((typeset(name), nodes + step))
        if f["rows"]:
            rows.append(("measured", f"{f['rows']} pairs of directions"))
        rows.append(("missing", percent(f["missing"]) + " of the table" if f["missing"] else "nothing"))
        if f["negative"]:
            rows.append(("negative", percent(f["negative"]) + " of the values"))
        if f["uncertainty"]:
            spread = f["uncertainty"]
            rows.append(("standard uncertainty", f"{percent(spread['low'])} to {percent(spread['high'])} of the value"))
        if f["scale_uncertainty"]:
            rows.append(("scale", f"uncertain by {percent(f['scale_uncertainty'])}"))
        return rows

    def provenance(self) -> str:
        """Where the numbers come from, and what to cite."""
        f = self.facts
        rows = []
        given = f.get("provenance") or {}
        if "path" in f:
            rows.append(("file", escape(str(given.get("file", f["path"])))))
            if f["bytes"]:
                rows.append(("size", f"{f['bytes']:,} bytes".replace(",", " ")))
        if "sha256" in given:
            rows.append(("sha256", f'<code class="hash">{escape(given["sha256"])}</code>'))
        rows += [("read by", f"gonio {escape(str(given['gonio']))}")] if "gonio" in given else []
        if given.get("options"):
            rows.append(("read with", escape(", ".join(f"{k}={v}" for k, v in given["options"].items()))))
        for origin in self._origins(given.get("converted_from")):
            rows.append(("made from", escape(origin)))
        rows += [("repaired", escape(r["summary"])) for r in f.get("repairs", [])]
        if f.get("path") and not f.get("repairs"):
            rows.append(("repairs", "none: values are as the file has them"))
        for name, value in (f.get("about") or {}).items():
            text = "; ".join(map(str, value)) if isinstance(value, list) else str(value)
            if text and name != "columns":
                rows.append((escape(name.replace("_", " ")), escape(text if len(text) <= 600 else text[:600] + " …")))
        if "path" not in f:
            rows.append(("origin", "a formula and its parameters, as above; no file was read"))
        if "source" in f:
            rows.append(("source of the numbers", escape(f["source"])))
        about = table(("", ""), rows, kind="facts") if rows else ""
        return f"{about}<details><summary>BibTeX to cite it</summary>{copied(self.one['citations'])}</details>"

    def _origins(self, origin: Any) -> list[str]:
        if isinstance(origin, list):
            return [text for of in origin for text in self._origins(of)]
        if not isinstance(origin, dict):
            return []
        digest = f", {origin.get('format')}, sha256 {origin['sha256']}" if "sha256" in origin else ""
        what = origin.get("file") or origin.get("material", "?")
        return [
            f"{what}{digest}, by {origin.get('converted_by', 'gonio')}",
            *self._origins(origin.get("converted_from")),
        ]

    def reproduce(self) -> str:
        """Code and commands."""
        given = self.one["reproduce"]
        shell = copied("\n".join(given["shell"]))
        return f"<h4>In Python</h4>{copied(given['python'])}<h4>On the command line</h4>{shell}"
