"""ARAIM of one epoch the slow way: plain loops, explicit clocks, tails by mpmath.

Written from the description of the algorithm and from nothing in the package.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import combinations

import mpmath as mp
import numpy as np

mp.mp.dps = 30

APPENDIX_D = (
    (0.0225, 0.9951, -0.0966, "G", 3.8865, 3.5740),
    (0.6750, -0.6900, -0.2612, "G", 1.4377, 1.1252),
    (0.0723, -0.6601, -0.7477, "G", 0.8604, 0.5479),
    (-0.9398, 0.2553, -0.2269, "G", 1.6383, 1.3258),
    (-0.5907, -0.7539, -0.2877, "G", 1.3229, 1.0104),
    (-0.3236, -0.0354, -0.9455, "E", 0.8434, 0.5309),
    (-0.6748, 0.4356, -0.5957, "E", 0.8963, 0.5838),
    (0.0938, -0.7004, -0.7075, "E", 0.8669, 0.5544),
    (0.5571, 0.3088, -0.7709, "E", 0.8573, 0.5448),
    (0.6622, 0.6958, -0.2780, "E", 1.3616, 1.0491),
)
"""East, north, up of the row, constellation, C_int, C_acc [m2]: ADD 3.0 (2017), Appendix D."""


def appendix_d() -> dict[str, np.ndarray]:
    """The example as arguments of AraimGeometry."""
    east, north, up, letter, c_int, c_acc = zip(*APPENDIX_D, strict=True)
    e, n, u = -np.array(east), -np.array(north), -np.array(up)
    return {
        "elevation_deg": np.rad2deg(np.arctan2(u, np.hypot(e, n))),
        "azimuth_deg": np.rad2deg(np.arctan2(e, n)),
        "constellation": np.array(letter),
        "sigma_int_m": np.sqrt(c_int),
        "sigma_acc_m": np.sqrt(c_acc),
        "b_nom_m": np.full(10, 0.5),
    }


def tail(u: object) -> mp.mpf:
    return mp.erfc(mp.mpf(u) / mp.sqrt(2)) / 2


def quantile(p: object) -> mp.mpf:
    """Q^-1(p), p < 1/2."""
    low, high = mp.mpf(0), mp.mpf(60)
    for _ in range(110):
        middle = (low + high) / 2
        low, high = (middle, high) if tail(middle) > p else (low, middle)
    return (low + high) / 2


@dataclass
class Mode:
    satellites: tuple[int, ...]
    letters: tuple[str, ...]
    prior: float
    sigma: list[float] = field(default_factory=list)
    bias: list[float] = field(default_factory=list)
    spread: list[float] = field(default_factory=list)
    gain: np.ndarray | None = None


@dataclass
class Answer:
    faults: int
    p_not_monitored: mp.mpf
    fix: Mode
    modes: list[Mode]
    k_alarm: list[mp.mpf]
    levels: list[mp.mpf]
    emt: float
    accuracy: list[float]


def gain_of(keep: list[int], el: np.ndarray, az: np.ndarray, letters: list[str],
            sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:  # fmt: skip
    """(3, m) gains and (3, 3) covariance of a fix, one clock for each letter in it."""
    clocks = sorted({letters[i] for i in keep})
    if len(keep) < 3 + len(clocks):
        return None
    g = np.zeros((len(keep), 3 + len(clocks)))
    for row, i in enumerate(keep):
        e, a = math.radians(el[i]), math.radians(az[i])
        g[row, :3] = (-math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), -math.sin(e))
        g[row, 3 + clocks.index(letters[i])] = 1.0
    root = 1 / sigma[keep]
    scaled = g * root[:, None]
    if np.linalg.cond(scaled) > 1e5:
        return None
    inverse = np.linalg.pinv(scaled)
    whole = np.zeros((3, len(el)))
    whole[:, keep] = (inverse * root)[:3]
    return whole, (inverse @ inverse.T)[:3, :3]


def solve(el: np.ndarray, az: np.ndarray, letters: list[str], sigma_int: np.ndarray,
          sigma_acc: np.ndarray, b_nom: np.ndarray, *, p_sat: float = 1e-5, p_con: float = 1e-4,
          phmi: tuple[float, ...] = (1e-9, 1e-9, 9.8e-8), total: float = 1e-7,
          alarm_tail: tuple[float, ...] = (9e-8 / 4, 9e-8 / 4, 3.9e-6 / 2), thres: float = 8e-8,
          p_emt: float = 1e-5, axes: np.ndarray | None = None) -> Answer:  # fmt: skip
    """Levels on the axes (q, 3), east, north and up where none are given."""
    axes = np.eye(3) if axes is None else axes
    m = len(el)
    events: list[tuple[str, object, float]] = [("sat", i, p_sat) for i in range(m)]
    events += [("con", c, p_con) for c in sorted(set(letters))]
    events = [event for event in events if event[2] > 0]
    total_prior = sum(event[2] for event in events)
    faults = 1
    while total_prior ** (faults + 1) / math.factorial(faults + 1) > thres:
        faults += 1
    # P(at most `faults` events) by the generating polynomial, at 30 digits.
    poly = [mp.mpf(1)]
    for *_, p in events:
        poly = [
            (poly[i] if i < len(poly) else 0) * (1 - mp.mpf(p))
            + (poly[i - 1] if i else 0) * mp.mpf(p)
            for i in range(len(poly) + 1)
        ]
    lost = mp.fsum(poly[faults + 1 :])

    def filled(mode: Mode, keep: list[int]) -> bool:
        answer = gain_of(keep, el, az, letters, sigma_int)
        if answer is None:
            return False
        gain, cov = answer
        mode.gain = axes @ gain
        mode.sigma = [math.sqrt(a @ cov @ a) for a in axes]
        mode.bias = [float(np.abs(s) @ b_nom) for s in mode.gain]
        return True

    fix = Mode((), (), math.nan)
    assert filled(fix, list(range(m)))
    modes: list[Mode] = []
    for size in range(1, faults + 1):
        for chosen in combinations(events, size):
            failed = {c for kind, c, _ in chosen if kind == "con"}
            sats = [i for kind, i, _ in chosen if kind == "sat"]
            if any(letters[i] in failed for i in sats):
                continue
            mode = Mode(tuple(sats), tuple(sorted(failed)), math.prod(p for *_, p in chosen))
            keep = [i for i in range(m) if i not in sats and letters[i] not in failed]
            if filled(mode, keep):
                modes.append(mode)
            else:
                lost += mp.mpf(mode.prior)
    for mode in modes:
        change = mode.gain - fix.gain
        mode.spread = [math.sqrt(d**2 @ sigma_acc**2) for d in change]
    left = 1 - lost / mp.mpf(total)
    k_alarm, levels = [], []
    for q in range(len(axes)):
        k = quantile(mp.mpf(alarm_tail[q]) / len(modes)) if modes else mp.nan
        k_alarm.append(k)
        levels.append(_level(fix, modes, q, k, mp.mpf(phmi[q]) * left))
    emt = max(
        (float(k_alarm[2]) * mode.spread[2] for mode in modes if mode.prior > p_emt * 0.999),
        default=math.nan,
    )
    accuracy = [math.sqrt(s**2 @ sigma_acc**2) for s in fix.gain]
    return Answer(faults, lost, fix, modes, k_alarm, levels, emt, accuracy)


def _level(fix: Mode, modes: list[Mode], q: int, k: mp.mpf, budget: mp.mpf) -> mp.mpf:
    if budget <= 0:
        return mp.inf

    def risk(level: mp.mpf) -> mp.mpf:
        terms = [2 * tail((level - fix.bias[q]) / fix.sigma[q])]
        for mode in modes:
            u = (level - k * mode.spread[q] - mode.bias[q]) / mode.sigma[q]
            terms.append(mp.mpf(mode.prior) * (tail(u) if u > 0 else 1))
        return mp.fsum(terms)

    low, high = mp.mpf(0), mp.mpf(1)
    while risk(high) > budget:
        high *= 2
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if risk(middle) > budget else (low, middle)
    return high
