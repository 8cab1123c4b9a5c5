"""The look of every picture, held in its own rc context: nobody's settings are touched.

Colours are those of Okabe and Ito (2008), told apart by colour-blind readers, and cividis for
counts. Sizes suit half the width of an A4 page, so that no text is below 6 pt in print.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
INK, MUTED, LINE = "#1b2530", "#56626e", "#d5dbe0"

RC: Any = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    # File names and labels are text, never formulas: faster, and "$" stays a dollar.
    "text.parse_math": False,
    "text.color": INK,
    "figure.facecolor": "white",
    "figure.dpi": 150.0,
    "savefig.bbox": None,
    "savefig.facecolor": "auto",
    "axes.facecolor": "white",
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.6,
    "axes.labelcolor": INK,
    "axes.labelsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.autolimit_mode": "data",
    "axes.xmargin": 0.01,
    "grid.color": LINE,
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 7.0,
    "legend.handlelength": 1.6,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "path.simplify": False,
    "svg.fonttype": "none",
    "svg.image_inline": True,
}


@contextmanager
def house_style() -> Iterator[None]:
    """Matplotlib with the look of this package, and back to the caller's settings after."""
    with matplotlib.rc_context(RC):
        yield


@dataclass(frozen=True)
class Sheet:
    """Size of a picture that stands alone, and the margins round its axes [inch]."""

    width: float
    height: float
    left: float = 0.62
    right: float = 0.12
    bottom: float = 0.42
    top: float = 0.12
    rows: int = 1

    def axes(self, figure: Figure | None = None) -> NDArray[Any]:
        """(rows,) axes, one above the other with a common abscissa, on a figure of this size."""
        if figure is None:
            from matplotlib.figure import Figure

            figure = Figure(figsize=(self.width, self.height))
        axes: NDArray[Any] = figure.subplots(
            self.rows,
            sharex=True,
            squeeze=False,
            gridspec_kw={
                "left": self.left / self.width,
                "right": 1 - self.right / self.width,
                "bottom": self.bottom / self.height,
                "top": 1 - self.top / self.height,
                "hspace": 0.16,
            },
        )
        return axes[:, 0]


HALF_WIDTH, FULL_WIDTH, HALF_HEIGHT = 3.9, 7.4, 3.5
"""Half and full width of an A4 page, enlarged by 1.15, and the usual height of a half [inch]."""


@contextmanager
def drawing(given: Sequence[Axes] | None, sheet: Sheet) -> Iterator[list[Axes]]:
    """The given axes, or new ones of the sheet, in the style of this package.

    A figure is made without pyplot, so that none stays behind; in a notebook pyplot makes it,
    since only its figures show themselves below the cell.
    """
    figure = None
    if given is None and _in_notebook():
        from matplotlib import pyplot

        # Outside the style: the notebook mode that a first figure switches on must outlive it.
        size = (sheet.width, sheet.height)
        figure = pyplot.figure(figsize=size, dpi=RC["figure.dpi"], facecolor="white")
    with house_style():
        axes = list(sheet.axes(figure)) if given is None else list(given)
        for ax in axes:
            # Ticks are made when drawn, perhaps outside this context: their look is fixed here.
            ax.tick_params(
                length=2.5, width=0.6, color=MUTED, labelcolor=INK, labelsize=7.5, pad=2.5
            )
            ax.tick_params(which="minor", length=1.5, width=0.4, color=MUTED)
        yield axes


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    return shell is not None and shell.get_ipython() is not None


def sentence(ax: Axes, text: str) -> None:
    """Say in the middle of empty axes why nothing is drawn."""
    note(ax, 0.5, 0.5, text, transform=ax.transAxes, color=MUTED, fontsize=8)


def note(ax: Axes, x: float, y: float, text: str, **options: Any) -> None:
    """Small text on a white ground, at data coordinates unless a transform is given."""
    box = {"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    usual: dict[str, Any] = {"fontsize": 7, "color": INK, "ha": "center", "va": "center"}
    ax.text(x, y, text, bbox=box, **(usual | options))


_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def power_of_ten(exponent: int) -> str:
    """10 to an integer power, in Unicode: no formula has to be set."""
    return "1" if exponent == 0 else f"10{str(exponent).translate(_SUPERSCRIPT)}"


def decades(low: float, high: float, *, at_most: int = 12) -> NDArray[np.int64]:
    """Exponents of the powers of ten within [low, high], thinned to a readable number."""
    first, last = int(np.ceil(np.log10(low) - 1e-9)), int(np.floor(np.log10(high) + 1e-9))
    step = max(1, -(-(last - first + 1) // at_most))
    return np.arange(first, last + 1, step)


def log_axis(ax: Axes, which: str, low: float, high: float) -> None:
    """A log axis from low to high with ticks at powers of ten (and 2, 5 where few fit)."""
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

    scale, limits = getattr(ax, f"set_{which}scale"), getattr(ax, f"set_{which}lim")
    axis = getattr(ax, f"{which}axis")
    scale("log")
    limits(low, high)
    if high / low <= 2e3:
        exponents = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
        ticks = [m * 10.0**e for e in exponents for m in (1, 2, 5) if low <= m * 10.0**e <= high]
        names = [f"{tick:g}" for tick in ticks]
    else:
        exponents = decades(low, high).tolist()
        ticks, names = [10.0**e for e in exponents], [power_of_ten(e) for e in exponents]
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FixedFormatter(names))
    axis.set_minor_locator(NullLocator())


def count_image(
    ax: Axes, counts: NDArray[np.int64], extent: tuple[float, float, float, float]
) -> AxesImage:
    """Counts on a grid (rows upwards) by colour on a log scale, with a bar; empty cells are clear.

    Parameters
    ----------
    counts : (rows, columns) counts, at least one above 0.
    extent : left, right, bottom, top of the grid in data units.
    """
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

    top = max(int(counts.max()), 2)
    image = ax.imshow(
        np.ma.masked_equal(counts, 0), origin="lower", extent=extent, cmap="cividis",
        norm=LogNorm(1, top), interpolation="none", aspect="auto", zorder=2,
    )  # fmt: skip
    bar = ax.inset_axes((1.03, 0.0, 0.035, 1.0))
    colours = ax.figure.colorbar(image, cax=bar)
    exponents = decades(1, top, at_most=7).tolist()
    bar.yaxis.set_major_locator(FixedLocator([10.0**e for e in exponents]))
    bar.yaxis.set_major_formatter(FixedFormatter([power_of_ten(e) for e in exponents]))
    bar.yaxis.set_minor_locator(NullLocator())
    bar.tick_params(length=2, width=0.5, labelsize=7, pad=2)
    bar.set_ylabel("epochs per cell", fontsize=7, labelpad=2)
    colours.outline.set_linewidth(0.4)
    return image
