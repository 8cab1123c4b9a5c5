"""A picture for the report, drawn on a figure of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sbas.plots.style import Sheet, house_style
from sbas.reporting.content import Picture
from sbas.reporting.inline_svg import inline_svg


def drawn(
    key: str,
    title: str,
    sheet: Sheet,
    draw: Callable[[Any], Any],
    alt: str,
    caption: str,
    *,
    wide: bool = False,
) -> Picture:
    """The picture that `draw` puts on fresh axes of the sheet.

    Parameters
    ----------
    key, title, alt, caption, wide : as in `Picture`.
    draw : called with the (rows,) axes.
    """
    with house_style():
        axes = sheet.axes()
    draw(axes)
    return Picture(key, title, alt, caption, inline_svg(axes[0].figure, key=key, alt=alt), wide)
