"""Is a chain of receiver states a first-order Markov chain, the same everywhere?

Each test gives a statistic, its degrees of freedom and a p-value; where it cannot be made it says
so. Likelihood-ratio tests with small expected counts take their p-value from tables drawn with the
same margins instead of the chi-square law.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from sbas.estimate import Refusal

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
LengthCounts = Sequence[tuple[int, int]]

LEAST_EXPECTED = 5.0
"""Expected count of a class or cell from which on the chi-square law serves."""

_DRAWS = 9999
_SEED = 1
_DRAWN_MOST = 1 << 30


@dataclass(frozen=True)
class MarkovTest:
    """One test: what is seen against what the chain would give.

    Parameters
    ----------
    name : of the test.
    statistic : G2, X2 or z.
    df : degrees of freedom; None for z.
    p : probability of a statistic at least as far off, if the chain were right.
    method : how p was found.
    observed, expected : counts of the tail test, else None.
    """

    name: str
    statistic: float
    df: int | None
    p: float
    method: str
    observed: float | None = None
    expected: float | None = None

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    def __str__(self) -> str:
        counts = (
            ""
            if self.expected is None
            else f"{self.observed:g} seen, {self.expected:.4g} expected, "
        )
        df = "" if self.df is None else f", df {self.df}"
        p = f"p {self.p:.3g}" if self.p > 0 else "p below 1e-300"
        return f"{self.name}: {counts}statistic {self.statistic:.4g}{df}, {p}"


def order_test(triples: ArrayLike) -> MarkovTest | Refusal:
    """Does the next state depend on the state before the present one?

    Parameters
    ----------
    triples : (s, s, s) counts n_ijk of successive states i, j, k.

    Returns
    -------
    MarkovTest; a Refusal where no state was reached from two states and left to two.

    Notes
    -----
    G2 = 2 sum n_ijk log(n_ijk n_.j. / (n_ij. n_.jk)), df = sum over j of (rows - 1)(columns - 1)
    of the rows and columns that are not empty; s (s-1)^2 when none is.

    References
    ----------
    T. W. Anderson, L. A. Goodman, Annals of Mathematical Statistics 28 (1957) 89, section 3.
    """
    counts = np.asarray(triples, dtype=np.int64)
    return _likelihood_ratio("order", [counts[:, j, :] for j in range(counts.shape[1])])


def pooling_test(counts: ArrayLike) -> MarkovTest | Refusal:
    """Do several records have one chain?

    Parameters
    ----------
    counts : (S, s, s) transition counts of S records, such as environments.

    Notes
    -----
    G2 = 2 sum n_eij log(n_eij n_.i. / (n_ei. n_.ij)), df s (s-1)(S-1) less empty rows and columns.

    References
    ----------
    T. W. Anderson, L. A. Goodman, Annals of Mathematical Statistics 28 (1957) 89, section 3.
    """
    tables = np.asarray(counts, dtype=np.int64)
    return _likelihood_ratio("pooling", [tables[:, i, :] for i in range(tables.shape[1])])


def _likelihood_ratio(name: str, tables: Sequence[Ints]) -> MarkovTest | Refusal:
    """Independence of rows and columns in each table, jointly."""
    kept = [t[t.sum(axis=1) > 0][:, t.sum(axis=0) > 0] for t in tables]
    kept = [t for t in kept if min(t.shape) > 1]
    df = sum((t.shape[0] - 1) * (t.shape[1] - 1) for t in kept)
    if df == 0:
        return Refusal(f"{name}: too few different transitions to compare", "record longer")
    g2 = sum(float(_g2(t[None])[0]) for t in kept)
    least = min(float(_expected(t[None]).min()) for t in kept)
    if least >= LEAST_EXPECTED or max(int(t.sum()) for t in kept) >= _DRAWN_MOST:
        return MarkovTest(name, g2, df, float(special.gammaincc(df / 2, g2 / 2)), "chi-square")
    rng = np.random.default_rng(_SEED)
    drawn = sum(_g2(_tables_with_margins(t, rng)) for t in kept)
    # Ties count as at least as far off; the tolerance is that of summing in another order.
    beyond = int(np.sum(drawn >= g2 - 1e-9 * max(g2, 1.0)))
    method = f"{_DRAWS} tables with the same margins, seed {_SEED}"
    return MarkovTest(name, g2, df, (beyond + 1) / (_DRAWS + 1), method)


def _expected(tables: Ints) -> Floats:
    rows, columns = tables.sum(axis=2, keepdims=True), tables.sum(axis=1, keepdims=True)
    expected: Floats = rows * (columns / tables.sum(axis=(1, 2), keepdims=True))
    return expected


def _g2(tables: Ints) -> Floats:
    """(m,) statistics of (m, r, c) tables; an empty cell adds nothing."""
    terms: Floats = special.xlogy(tables, tables) - special.xlogy(tables, _expected(tables))
    total: Floats = 2 * terms.sum(axis=(1, 2))
    return total


def _tables_with_margins(table: Ints, rng: np.random.Generator) -> Ints:
    """(_DRAWS, r, c) tables with the margins of one, rows and columns independent."""
    left = np.repeat(table.sum(axis=0)[None], _DRAWS, axis=0)
    out = np.zeros((_DRAWS, *table.shape), np.int64)
    for i, total in enumerate(table.sum(axis=1)[:-1]):
        wanted = np.full(_DRAWS, total)
        for j in range(table.shape[1] - 1):
            rest = left[:, j + 1 :].sum(axis=1)
            out[:, i, j] = rng.hypergeometric(left[:, j], rest, wanted)
            wanted = wanted - out[:, i, j]
        out[:, i, -1] = wanted
        left = left - out[:, i]
    out[:, -1] = left
    return out


def sojourn_test(
    state: str, stay: float | None, completed: LengthCounts, rooms: LengthCounts
) -> MarkovTest | Refusal:
    """Do runs of a state last as in a Markov chain: geometrically?

    Parameters
    ----------
    state : its name.
    stay : a, probability to stay for one epoch; None where it was never left.
    completed : (length, count) of runs whose begin and end were seen.
    rooms : (room, count) of all runs whose begin was seen: epochs from it to the end of the
        stretch without a cut. A run of length r is seen to end only in a room above r.

    Returns
    -------
    MarkovTest: X2 over classes of length with expected counts of 5 or more, the last one with
    all runs that were cut; df = classes - 2.

    Notes
    -----
    Expected number of completed runs of length r: (1-a) a^(r-1) times the runs with room above r,
    so that cuts do not pass for short runs.
    """
    name = f"sojourn {state}"
    begun = sum(n for _, n in rooms)
    if stay is None or not 0.0 < stay < 1.0 or begun == 0:
        return Refusal(f"{name}: no runs with varying length", "record longer")
    # Beyond the length that one run in 1e12 would reach nothing is expected.
    longest = min(max(r for r, _ in rooms), math.ceil(-27.6 / math.log(stay)) + 1)
    length = np.arange(1, longest + 1)
    room, count = np.array(rooms).T
    per_room = np.bincount(np.minimum(room, longest + 1), weights=count, minlength=longest + 2)
    above = np.cumsum(per_room[::-1])[::-1]
    expected = np.exp((length - 1) * math.log(stay)) * (1.0 - stay) * above[length + 1]
    ends = _class_ends(np.cumsum(expected), float(begun))
    if len(ends) + 1 < 3:
        return Refusal(f"{name}: fewer than three classes of length", "record longer")
    seen = np.zeros(longest + 1)
    for r, n in completed:
        if r <= longest:
            seen[r] += n
    below_expected = np.cumsum(expected)[np.array(ends) - 1]
    below_seen = np.cumsum(seen)[np.array(ends)]
    e = np.diff(below_expected, prepend=0.0, append=float(begun))
    o = np.diff(below_seen, prepend=0.0, append=float(begun))
    x2 = float(np.sum((o - e) ** 2 / e))
    df = len(e) - 2
    return MarkovTest(name, x2, df, float(special.gammaincc(df / 2, x2 / 2)), "chi-square")


def _class_ends(cumulative: Floats, total: float) -> list[int]:
    """Last lengths of the classes but the last one, each class with `LEAST_EXPECTED` or more."""
    ends: list[int] = []
    reached = 0.0
    while True:
        at = int(np.searchsorted(cumulative, reached + LEAST_EXPECTED))
        if at >= cumulative.size or total - cumulative[at] < LEAST_EXPECTED:
            return ends
        reached = float(cumulative[at])
        ends.append(at + 1)


def tail_test(
    state: str,
    k: int,
    stay: float | None,
    at_risk: int,
    completed: LengthCounts,
    censored: LengthCounts,
    rooms: LengthCounts,
) -> MarkovTest | Refusal:
    """Do as many runs of a state reach k epochs as in a Markov chain?

    Parameters
    ----------
    state, stay, completed, rooms : as for `sojourn_test`.
    k : length of the runs that matter, such as the count of a CON gate.
    at_risk : transitions out of the state, staying included, from which `stay` was estimated.
    censored : (length, count) of runs whose begin was seen, but not their end.

    Notes
    -----
    Expected: a^(k-1) times the N runs with room of k or more. z has the variance
    N p (1-p) - (N dp/da)^2 a (1-a)/n, since a was estimated from the same n transitions; where
    fewer than 5 are expected to reach k, or not to, the binomial law with p = a^(k-1).
    """
    name = f"tail {state}"
    begun = sum(n for room, n in rooms if room >= k)
    if stay is None or not 0.0 < stay < 1.0 or begun == 0 or k < 2:
        return Refusal(f"{name}: no runs that could reach {k} epochs", "record longer")
    reached = sum(n for length, n in (*completed, *censored) if length >= k)
    p = stay ** (k - 1)
    expected = begun * p
    spread = (
        begun * p * (1.0 - p) - (begun * (k - 1) * p / stay) ** 2 * stay * (1.0 - stay) / at_risk
    )
    if min(expected, begun - expected) >= LEAST_EXPECTED and spread > 0.0:
        z = (reached - expected) / math.sqrt(spread)
        tail = math.erfc(abs(z) / math.sqrt(2))
        return MarkovTest(name, z, None, tail, "normal", reached, expected)
    z = (reached - expected) / math.sqrt(expected * (1.0 - p))
    many = special.betainc(reached, begun - reached + 1, p) if reached else 1.0
    few = special.betaincc(reached + 1, begun - reached, p) if reached < begun else 1.0
    both = min(1.0, 2.0 * float(min(many, few)))
    return MarkovTest(name, z, None, both, "binomial", reached, expected)
