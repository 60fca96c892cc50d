"""Formulas of docstrings as HTML: Greek letters, indices, powers."""

from __future__ import annotations

import re
from html import escape

GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "eta": "η", "theta": "θ", "kappa": "κ",
    "lambda": "λ", "mu": "μ", "xi": "ξ", "pi": "π", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "psi": "ψ",
    "omega": "ω", "Lambda": "Λ", "Omega": "Ω", "Phi": "Φ", "Delta": "Δ",
}  # fmt: skip
"""Names of letters -> letters."""

RULES = (
    (r"\\(?:mathrm|text|operatorname)\{([^{}]*)\}", r"\1"),
    (r"\\d?frac\{([^{}]*)\}\{([^{}]*)\}", r"(\1)/(\2)"),
    (r"\\(?:left|right|,|;|quad|big|Big)\b ?", ""),
    (r"\\(cos|sin|tan|exp|log|ln|sqrt|max|min)\b", r"\1"),
    (r"\\cdot\b", "·"),
    (rf"\\?\b({'|'.join(GREEK)})(?=_|\b|\d)", lambda found: GREEK[found[1]]),
    (r"\$\$?", ""),
    (r"\bsqrt\b", "√"),
    (r"\bw([iomth])\b", r"ω_\1"),
    (r"&lt;=", "≤"),
    (r"&gt;=", "≥"),
    (r" \* ", " · "),
    (r"\^\{([^{}]*)\}", r"<sup>\1</sup>"),
    (r"_\{([^{}]*)\}", r"<sub>\1</sub>"),
    (r"\^\((-?[^()\s]{1,12})\)", r"<sup>\1</sup>"),
    (r"\^(-?[\wα-ωΑ-Ω]+(?:\.\d+)?)", r"<sup>\1</sup>"),
    (r"(?<=[A-Za-zα-ωΑ-Ω])_([A-Za-z0-9]{1,4})\b", r"<sub>\1</sub>"),
)
"""What is written -> what is shown, in this order."""


def typeset(text: str) -> str:
    """A docstring's text as HTML; what stands in backticks stays as it is, as code."""
    parts = re.split(r"`([^`]*)`", text)
    shown = []
    for k, part in enumerate(parts):
        if k % 2:
            shown.append(f"<code>{escape(part)}</code>")
            continue
        line = escape(part, quote=False)
        for rule, by in RULES:
            line = re.sub(rule, by, line)
        shown.append(line)
    return "".join(shown)
