"""A drawn figure as SVG that may stand in an HTML page beside others."""

from __future__ import annotations

import io
import re
from html import escape
from typing import TYPE_CHECKING

import matplotlib

from sbas.plots.style import house_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def inline_svg(figure: Figure, *, key: str, alt: str) -> str:
    """The figure as one `<svg>` element without size, metadata or outside reference.

    Parameters
    ----------
    figure : drawn in the house style.
    key : salt of the ids within, which keeps those of several pictures apart.
    alt : what a reader who cannot see the picture is told.

    Returns
    -------
    The same text for the same drawing, whenever and wherever it is made.
    """
    target = io.StringIO()
    with house_style(), matplotlib.rc_context({"svg.hashsalt": f"sbas-{key}"}):
        figure.savefig(target, format="svg", metadata={"Date": None})
    text = target.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, count=1, flags=re.DOTALL)
    width, height = (72 * size for size in figure.get_size_inches())
    start = (
        f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(alt)}" '
        f'preserveAspectRatio="xMidYMid meet">'
    )
    text = start + text[text.index(">") + 1 :]
    text = text.replace("xlink:href=", "href=")
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', text))
    text = re.sub(r' id="([^"]*)"', lambda m: m[0] if m[1] in used else "", text)
    return re.sub(r"\s*\n\s*", "\n", text).strip()
