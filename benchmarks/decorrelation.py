"""Bias and coverage of the decorrelation time, its misfit flags, and its speed.

    python benchmarks/decorrelation.py                  # everything
    python benchmarks/decorrelation.py coverage 300 60  # records of the clean, the other cases
    python benchmarks/decorrelation.py mixtures 60
    python benchmarks/decorrelation.py shape 150
    python benchmarks/decorrelation.py speed

Records of 3e5 s at 1 Hz, two components; seeds are fixed. Nothing is asserted here.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from concurrent.futures import ProcessPoolExecutor

# Two processes share the cores: threads of the linear algebra would only wait for each other.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from scipy.signal import lfilter

from sbas.estimate import Estimate
from sbas.integrity.correlation.autocorrelation import autocorrelation
from sbas.integrity.correlation.correlation import decorrelation_of
from sbas.integrity.correlation.process_shape import process_shape
from sbas.integrity.correlation.robust_tau import clean, fit_exponentials, longest_lag
from sbas.integrity.correlation.tau_interval import tau_interval

SECONDS = 300_000
MASKS = 6
"""Different patterns of gaps in a case; every one needs its own simulated distribution."""
CASES = ("clean", "gaps", "white", "outliers", "bursts", "diurnal", "all")


def gauss_markov(rng: np.random.Generator, n: int, tau_s: float) -> np.ndarray:
    """(2, n) independent components of unit variance, 1 s apart."""
    rho = np.exp(-1 / tau_s)
    noise = rng.standard_normal((2, n)) * np.sqrt(1 - rho**2)
    noise[:, 0] /= np.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], noise)


def gaps(seed: int, n: int) -> np.ndarray:
    """(n,) True in gaps of 1 s to 1 h, log-uniform, until 15 % of the record is lost."""
    rng = np.random.default_rng([15, seed])
    lost = np.zeros(n, bool)
    while lost.mean() < 0.15:
        start = rng.integers(n)
        lost[start : start + int(3600 ** rng.random())] = True
    return lost


def record(case: str, tau_s: float, seed: int) -> np.ndarray:
    """(2, n) errors of one case, sigma 1."""
    rng = np.random.default_rng([CASES.index(case), int(tau_s), seed])
    x = gauss_markov(rng, SECONDS, tau_s)
    every = case == "all"
    if case == "white" or every:
        x = np.sqrt(0.7) * x + np.sqrt(0.3) * rng.standard_normal(x.shape)
    if case == "diurnal" or every:
        phase = rng.uniform(0, 2 * np.pi, (2, 1))
        x = x + np.cos(2 * np.pi * np.arange(SECONDS) / 86400 + phase)
    if case == "outliers" or every:
        hit = rng.random(SECONDS) < 1e-3
        x[:, hit] += 60 * rng.choice([-1.0, 1.0], (2, int(hit.sum())))
    if case == "bursts" or every:
        for start in rng.integers(0, SECONDS - 30, 20):
            x[:, start : start + 30] += 30 * rng.choice([-1.0, 1.0], (2, 1))
    if case == "gaps" or every:
        x[:, gaps(seed % MASKS, SECONDS)] = np.nan
    return x.astype(np.float32)


def one_case(arguments: tuple[str, float, int]) -> str:
    case, tau, records = arguments
    values, held, flags, raw, below = [], 0, 0, [], 0
    for seed in range(records):
        result = decorrelation_of(record(case, tau, seed), 1.0)
        assert isinstance(result.tau_s, Estimate)
        assert result.definitions is not None
        values.append(result.tau_s.value)
        raw.append(result.definitions["robust_fit_s"])
        low, high = result.tau_low_s or 0.0, result.tau_high_s or np.inf
        held += low <= tau <= high
        below += high < tau
        flags += result.misfit != "gm1"
    median = float(np.median(values)) / tau
    error = 1.2533 * float(np.std(values)) / tau / np.sqrt(records)
    return (
        f"coverage tau {tau:g} s {case} {records} records: held {100 * held / records:.1f} % "
        f"(too low {below}, too high {records - held - below}), median {median:.3f} +- {error:.3f} "
        f"of the truth, uncorrected fit {np.median(raw) / tau:.3f}, not gm1 {flags}"
    )


def coverage(clean_records: int, others: int) -> None:
    jobs = [
        (case, tau, clean_records if case == "clean" else others)
        for case in CASES
        for tau in (1500.0, 360.0)
    ]
    with ProcessPoolExecutor(2) as pool:
        for line in pool.map(one_case, jobs):
            print(line, flush=True)


def mixtures(records: int) -> None:
    for first, second in ((30.0, 1500.0), (100.0, 720.0)):
        flagged, taus = 0, []
        for seed in range(records):
            rng = np.random.default_rng([7, int(first), seed])
            x = gauss_markov(rng, SECONDS, first) + gauss_markov(rng, SECONDS, second)
            result = decorrelation_of((x / np.sqrt(2)).astype(np.float32), 1.0)
            flagged += result.misfit == "mixture"
            if result.two_processes is not None:
                two = result.two_processes
                taus.append((two.tau_1_s, two.tau_2_s, two.share_1, two.tau_short_s))
        middle = ", ".join(f"{v:.4g}" for v in np.median(taus, axis=0))
        print(
            f"mixture .5({first:g} s) + .5({second:g} s): flagged {flagged} of {records}; "
            f"medians of tau 1, tau 2, share 1, tau short: {middle}",
            flush=True,
        )


def shape(records: int) -> None:
    """Sampling error of the two shape figures, for the limits in process_shape.py."""
    tau = 100.0
    for lengths in (25, 50, 100, 200, 833):
        for white in (0.0, 0.3):
            found = []
            for seed in range(records):
                rng = np.random.default_rng([25, lengths, seed])
                x = np.sqrt(1 - white) * gauss_markov(rng, int(lengths * tau), tau)
                x += np.sqrt(white) * rng.standard_normal(x.shape)
                cleaned = clean(x.astype(np.float32), 1.0)
                lag = longest_lag(x.shape[1], 1.0)
                seen = process_shape(autocorrelation(cleaned.values, step_s=1.0, max_lag=lag))
                found.append((np.log(seen.late_over_early), seen.short_lag_exponent))
            sd = np.nanstd(found, axis=0) * np.sqrt(lengths)
            print(f"shape T/tau {lengths:4d} white {white:g}: sd * sqrt(T/tau) of ln(late/early) "
                  f"{sd[0]:.2f}, of the exponent {sd[1]:.2f}", flush=True)  # fmt: skip


def speed() -> None:
    for n, lost in ((300_000, False), (300_000, True), (30_000_000, False), (30_000_000, True)):
        rng = np.random.default_rng(1)
        x = np.empty((2, n), np.float32)
        for part in range(0, n, 3_000_000):
            x[:, part : part + 3_000_000] = gauss_markov(rng, min(n, 3_000_000), 360.0)
        if lost:
            for part in range(0, n, 300_000):
                x[:, part : part + 300_000][:, gaps(part, 300_000)] = np.nan
        begin = time.perf_counter()
        cleaned = clean(x, 1.0)
        acf = autocorrelation(cleaned.values, step_s=1.0, max_lag=longest_lag(n, 1.0))
        tau = float(fit_exponentials(acf.mean[None], 1.0).tau_s[0])
        point = time.perf_counter() - begin
        begin = time.perf_counter()
        interval = tau_interval(cleaned, 1.0, pilot_s=tau)
        inverted = time.perf_counter() - begin
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
        print(
            f"speed {n:.0e} samples{', 15 % lost' if lost else ''}: point {point:.2f} s, interval "
            f"{inverted:.2f} s [{interval.low_s:.1f}, {interval.high_s:.1f}] about "
            f"{interval.value_s:.1f} s, peak memory so far {peak:.2f} GB",
            flush=True,
        )


def main() -> None:
    what, *counts = sys.argv[1:] or ["everything"]
    numbers = [int(c) for c in counts]
    if what in ("coverage", "everything"):
        coverage(*(numbers or [300, 60]))
    if what in ("mixtures", "everything"):
        mixtures(*(numbers or [60]))
    if what in ("shape", "everything"):
        shape(*(numbers or [150]))
    if what in ("speed", "everything"):
        speed()


if __name__ == "__main__":
    main()
