"""Formulas as MathML, which browsers show without a script: the manual needs no network."""

from __future__ import annotations

from typing import Any


def mathml(latex: str, display: str) -> str:
    """A formula in LaTeX as MathML; what no reader of LaTeX could read raises."""
    from latex2mathml.converter import convert

    return convert(latex, display=display)


def inline(writer: Any, node: Any) -> None:
    from docutils.nodes import SkipNode

    writer.body.append(mathml(node.astext(), "inline"))
    raise SkipNode


def block(writer: Any, node: Any) -> None:
    from docutils.nodes import SkipNode

    writer.body.append(f'<div class="formula">{mathml(node.astext(), "block")}</div>\n')
    raise SkipNode


def setup(app: Any) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
