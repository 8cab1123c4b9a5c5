"""Coverage and width of demonstrated and modelled rates on simulated correlated records.

    python benchmarks/rate_coverage.py [RECORDS]      # 300 records unless told; 5 to 8 minutes

Records of 3e5 s at 1 Hz, two Gauss-Markov components, decorrelation time 360 or 1500 s, fixed
seeds. "Coverage" is how often the one-sided 95 % upper bound holds the true rate, "width" the
median of the bound over the truth. The true rate is the hazard of the sampled process, exact.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, signal

from sbas.estimate import Estimate
from sbas.integrity.counting import garwood_limits
from sbas.integrity.exposure.extremal_clusters import run_clusters
from sbas.integrity.exposure.gauss_markov_sampled import extremal_index
from sbas.integrity.tails.declustering import count_exceedances, demonstrated_rate, merge_time_s
from sbas.integrity.tails.sampled_clock import hazard_per_s
from sbas.integrity.tails.tail_fit import fit_tail
from sbas.integrity.tails.tail_model import modelled_rate

Floats = NDArray[np.float64]

SECONDS, TAUS_S, EXPECTED = 300_000, (360.0, 1500.0), (0.5, 3.0, 16.0, 61.0)
HOURS = SECONDS / 3600
K_NPA = 6.18


def gauss_markov(
    generator: np.random.Generator, tau_s: float, *, parts: int = 2, nugget: float = 0.0
) -> Floats:
    """(parts, n) components of unit variance at 1 Hz."""
    r = math.exp(-1 / tau_s)
    drawn = generator.standard_normal((parts, SECONDS))
    drawn[:, 1:] *= math.sqrt(1 - r * r)
    slow = signal.lfilter([1.0], [1.0, -r], drawn, axis=1)
    if nugget == 0:
        return np.asarray(slow)
    white = generator.standard_normal(slow.shape)
    return np.asarray(math.sqrt(1 - nugget) * slow + math.sqrt(nugget) * white)


def true_rate_per_h(k: float, tau_s: float, nugget: float = 0.0) -> float:
    theta = extremal_index(k, correlation=math.exp(-1 / tau_s), nugget=nugget)
    return 3600 * theta * math.exp(-k * k / 2)


def level_of(expected: float, tau_s: float) -> float:
    """K that is reached anew so many times in a record, on average."""
    return float(
        optimize.brentq(lambda k: true_rate_per_h(k, tau_s) * HOURS - expected, 2.0, 6.0, xtol=1e-6)
    )


# --- demonstrated -----------------------------------------------------------------------------


def counted_bounds(error: Floats, k: float, tau_s: float) -> dict[str, float]:
    """Upper bounds per hour of several ways to count."""
    at = np.flatnonzero(error >= k)
    merge = merge_time_s(tau_s)
    mine = count_exceedances(at, interval_s=1.0, exposed_s=SECONDS, merge_s=merge)
    rate = demonstrated_rate(mine, 0.95)
    counts = {
        "samples": at.size,
        "raw crossings": run_clusters(at, merge_samples=0).count,
        "runs at tau/2, whole time": mine.clusters,
        "larger of it and Ferro-Segers": max(mine.clusters, mine.ferro_segers or 0),
    }
    bounds = {name: float(garwood_limits(n, 0.95)[1]) / HOURS for name, n in counts.items()}
    bounds["runs at tau/2, time at risk"] = (
        rate.upper if isinstance(rate, Estimate) and rate.upper is not None else math.nan
    )
    return bounds


def demonstrated(records: int) -> None:
    print(f"\ndemonstrated, {records} records each (seed 1): coverage (width)")
    for tau in TAUS_S:
        levels = {expected: level_of(expected, tau) for expected in EXPECTED}
        ratios: dict[str, dict[float, list[float]]] = {}
        generator = np.random.default_rng(1)
        for _ in range(records):
            error = np.hypot(*gauss_markov(generator, tau))
            for expected, k in levels.items():
                for name, upper in counted_bounds(error, k, tau).items():
                    ratios.setdefault(name, {}).setdefault(expected, []).append(
                        upper * HOURS / expected
                    )
        print(f"| tau {tau:g} s | " + " | ".join(f"{e:g} expected" for e in EXPECTED) + " |")
        for name, of in ratios.items():
            cells = [f"{np.mean(np.array(of[e]) >= 1):.3f} ({np.median(of[e]):.2f})"
                     for e in EXPECTED]  # fmt: skip
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


# --- modelled ---------------------------------------------------------------------------------


def peaks_over_threshold_per_h(error: Floats, k: float, generator: np.random.Generator) -> float:
    """Upper bound by what is usually done: a Pareto tail on the maxima of clusters.

    Threshold 95 %, runs merged at 30 minutes, probability-weighted moments (Hosking and Wallis
    1987), 95 % point of 200 bootstraps of the clusters.
    """
    y = error**2 / 2
    u = np.quantile(y, 0.95)
    clusters = run_clusters(np.flatnonzero(y >= u), merge_samples=1800)
    peaks = np.array([y[a : b + 1].max() for a, b in zip(clusters.first, clusters.last,
                                                          strict=True)]) - u  # fmt: skip
    rates = []
    for _ in range(200):
        x = np.sort(generator.choice(peaks, peaks.size))
        first = float(x.mean())
        weight = (np.arange(x.size, 0, -1) - 0.65) / x.size
        second = float((x * weight).mean())
        shape = 2 - first / (first - 2 * second)
        scale = 2 * first * second / (first - 2 * second)
        core = 1 + shape * (k * k / 2 - u) / scale
        tail = core ** (-1 / shape) if core > 0 else 0.0
        rates.append(generator.poisson(peaks.size) / HOURS * tail)
    return float(np.quantile(rates, 0.95))


def modelled(records: int, title: str, *, nugget: float = 0.0, axis_ratio: float = 1.0) -> None:
    print(f"\nmodelled {title}, rate at K = {K_NPA} (seed 2), {records} records each")
    print("| tau | method | printed | coverage | value/truth 5, 50, 95 % | width 5, 50, 95 % |")
    when = np.arange(SECONDS, dtype=float)
    for tau in TAUS_S:
        truth = true_rate_per_h(K_NPA, tau, nugget)
        if axis_ratio < 1:
            truth = 3600 * hazard_per_s(K_NPA, tau_s=tau, interval_s=1.0, axis_ratio=axis_ratio)
        generator, other = np.random.default_rng(2), np.random.default_rng(3)
        values, uppers, usual = [], [], []
        for _ in range(records):
            error = gauss_markov(generator, tau, nugget=nugget)
            error = np.array([[1.0], [axis_ratio]]) * error
            fit = fit_tail(error, 1.0, time_s=when, interval_s=1.0, tau_s=tau, nugget=nugget)
            rate = modelled_rate(fit, K_NPA)
            if isinstance(rate, Estimate) and rate.upper is not None:
                values.append(rate.value / truth)
                uppers.append(rate.upper / truth)
            if nugget == 0 and axis_ratio == 1:
                peaks = peaks_over_threshold_per_h(np.hypot(*error), K_NPA, other)
                usual.append(peaks / truth)
        row(tau, "tail of all exceedances", values, uppers, records)
        if usual:
            row(tau, "Pareto on cluster maxima", None, usual, records)


def row(
    tau: float, name: str, values: list[float] | None, uppers: list[float], records: int
) -> None:
    def three(ratios: list[float]) -> str:
        return ", ".join(f"{q:.3g}" for q in np.quantile(ratios, [0.05, 0.5, 0.95]))

    covered = float(np.mean(np.array(uppers) >= 1))
    print(
        f"| {tau:g} s | {name} | {len(uppers) / records:.3f} | {covered:.3f} | "
        f"{three(values) if values else 'not computed'} | {three(uppers)} |", flush=True,
    )  # fmt: skip


# --- misfits ----------------------------------------------------------------------------------


def scale_t5(generator: np.random.Generator, tau_s: float) -> Floats:
    """Random scale of a t distribution with 5 degrees of freedom, moving with tau."""
    chi2 = (gauss_markov(generator, tau_s, parts=5) ** 2).mean(axis=0)
    return np.asarray(1 / np.sqrt(chi2))


def amplitude(generator: np.random.Generator, tau_s: float) -> Floats:
    """3 for 5 % of the time, in spells that move with tau; else 1."""
    return np.where(gauss_markov(generator, tau_s, parts=1)[0] > 1.645, 3.0, 1.0)


Misfit = Callable[[np.random.Generator, float], Floats]
MISFITS: dict[str, Misfit] = {
    "mixture .95 N(0,1) + .05 N(0,9), spells of tau": lambda g, tau: (
        gauss_markov(g, tau) * amplitude(g, tau)
    ),
    "the same, spells of tau/10": lambda g, tau: gauss_markov(g, tau) * amplitude(g, tau / 10),
    "the same, independent epochs": lambda g, tau: (
        gauss_markov(g, tau) * np.where(g.random(SECONDS) < 0.05, 3.0, 1.0)
    ),
    "t5 by a random scale of tau": lambda g, tau: gauss_markov(g, tau) * scale_t5(g, tau),
    "t5 by a random scale of tau/10": lambda g, tau: gauss_markov(g, tau) * scale_t5(g, tau / 10),
    "t5 by a random scale of 3 tau": lambda g, tau: gauss_markov(g, tau) * scale_t5(g, 3 * tau),
    "bias of 1 sigma (signed errors)": lambda g, tau: (
        gauss_markov(g, tau) + np.array([[1.0], [0.0]])
    ),
    "bias of 0.5 sigma (signed errors)": lambda g, tau: (
        gauss_markov(g, tau) + np.array([[0.5], [0.0]])
    ),
    "bias of 2 sigma (sizes only)": lambda g, tau: np.hypot(
        *(gauss_markov(g, tau) + np.array([[2.0], [0.0]]))
    )[None],
    "clipped at 3 sigma": lambda g, tau: clipped(gauss_markov(g, tau), 3.0),
    "clipped at 3.5 sigma": lambda g, tau: clipped(gauss_markov(g, tau), 3.5),
    "bounded smoothly, 3 tanh(r/3)": lambda g, tau: bounded(gauss_markov(g, tau), 3.0),
    "8 % white noise, not declared": lambda g, tau: gauss_markov(g, tau, nugget=0.0826),
    "tau declared 4 times too long": lambda g, tau: gauss_markov(g, tau / 4),
}


def clipped(error: Floats, limit: float) -> Floats:
    return np.asarray(error * np.minimum(1, limit / np.hypot(*error)))


def bounded(error: Floats, limit: float) -> Floats:
    size = np.hypot(*error)
    return np.asarray(error * limit * np.tanh(size / limit) / size)


def misfits(records: int) -> None:
    print(f"\nmisfits, share refused of {records} records each (seed 4)")
    print("| misfit | " + " | ".join(f"tau {tau:g} s" for tau in TAUS_S) + " |")
    when = np.arange(SECONDS, dtype=float)
    for name, make in MISFITS.items():
        cells = []
        for tau in TAUS_S:
            generator = np.random.default_rng(4)
            refused = 0
            for _ in range(records):
                fit = fit_tail(make(generator, tau), 1.0, time_s=when, interval_s=1.0, tau_s=tau)
                refused += not isinstance(modelled_rate(fit, K_NPA), Estimate)
            cells.append(f"{refused / records:.3f}")
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    records = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    begin = time.perf_counter()
    demonstrated(2 * records)
    modelled(records, "Gaussian records")
    modelled(records // 4, "with 8.26 % white noise, declared", nugget=0.0826)
    modelled(records // 4, "with axis ratio 0.5 (true rate to a few per cent)", axis_ratio=0.5)
    misfits(records // 4)
    print(f"\nin {time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
