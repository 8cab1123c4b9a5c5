"""The Stanford diagram: protection level against error, by counts, with its regions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sbas.integrity.results import Evaluation
from sbas.plots.style import (
    HALF_HEIGHT,
    HALF_WIDTH,
    INK,
    VERMILION,
    Sheet,
    count_image,
    drawing,
    note,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT, right=0.62)


def stanford(
    evaluation: Evaluation, *, alert_limit_m: float | None = None, ax: Axes | None = None
) -> Axes:
    """HPL against HPE of every judged epoch, and how many lie in each Stanford region.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    alert_limit_m : one of the evaluation's alert limits, to which the written counts belong;
        the largest by default.
    ax : axes to draw on; a new figure without them.

    Raises
    ------
    KeyError : an alert limit that was not evaluated.

    References
    ----------
    T. Walter, Stanford chart `hplstat.m` (1998). The last row and column hold all that lies
    beyond; their ticks say so.
    """
    limits = evaluation.settings.alert_limits_m
    limit = max(limits) if alert_limit_m is None else alert_limit_m
    regions = evaluation.at(limit).regions
    counts, cell = evaluation.curves.stanford_counts, evaluation.curves.stanford_cell_m
    edge = cell * counts.shape[0]
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("horizontal position error HPE [m]")
        ax.set_ylabel("horizontal protection level HPL [m]")
        if regions is None or not counts.any():
            sentence(ax, "no epoch with both an error and\na protection level in this recording")
            return ax
        ax.grid(False)
        # Below the diagonal the level does not bound the error.
        ax.fill([0, edge, edge], [0, 0, edge], color=VERMILION, alpha=0.07, linewidth=0, zorder=0)
        ax.fill(
            [limit, edge, edge, limit], [0, 0, limit, limit], color=VERMILION, alpha=0.13,
            linewidth=0, zorder=0,
        )  # fmt: skip
        count_image(ax, counts, (0, edge, 0, edge))
        ax.plot([0, edge], [0, edge], color=INK, linewidth=0.8, zorder=3)
        for each in limits:
            width = 0.9 if each == limit else 0.4
            ax.axhline(each, linestyle=(0, (4, 2)), color=INK, linewidth=width, zorder=3)
        ax.plot([limit, limit], [0, limit], linestyle=(0, (4, 2)), color=INK, linewidth=0.9)
        ticks = [each for each in _ticks(edge) if each < edge * 0.95]
        overflow = f"≥ {edge - cell:.4g}"
        ax.set_xticks([*ticks, edge], [*_names(ticks), overflow if counts[:, -1].any() else ""])
        ax.set_yticks([*ticks, edge], [*_names(ticks), overflow if counts[-1].any() else ""])
        ax.yaxis.set_label_coords(-0.125, 0.5)
        ax.set_xlim(0, edge)
        ax.set_ylim(0, edge)
        beyond = (limit + edge) / 2
        places = {
            "nominal": (limit * 0.36, limit * 0.72, "nominal"),
            "unavailable": (limit * 0.36, beyond, "unavailable"),
            "mi_unavailable": ((limit + 2 * edge) / 3, (2 * limit + edge) / 3, "MI,\nunavail."),
            "mi": (limit * 0.68, limit * 0.3, "MI"),
            "hmi": (beyond, limit * 0.3, "HMI"),
        }
        for region, (x, y, name) in places.items():
            bad = region in ("mi", "hmi", "mi_unavailable") and regions[region] > 0
            note(
                ax, x, y, f"{name}\n{regions[region]:,}", zorder=4,
                fontsize=6 if region == "mi_unavailable" else 7,
                fontweight="bold" if bad else "normal", color=VERMILION if bad else INK,
            )  # fmt: skip
        note(
            ax, 0.99, 0.015, f"counts for AL {limit:g} m; without error or level: "
            f"{regions['missing']:,}", transform=ax.transAxes, ha="right", va="bottom",
            fontsize=6.5, zorder=4,
        )  # fmt: skip
        return ax


def _ticks(edge: float) -> list[float]:
    """Round values from 0, five to eight of them."""
    step = next(m * 10.0**e for e in range(-3, 6) for m in (1, 2, 5) if edge / (m * 10.0**e) <= 7)
    return [i * step for i in range(int(edge / step) + 1)]


def _names(ticks: list[float]) -> list[str]:
    return [f"{tick:g}" for tick in ticks]
