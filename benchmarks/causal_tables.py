"""Tables 2 to 4 and statements of Railways 2014 against simulations of its architectures.

    python -m benchmarks.causal_tables [RUNS [SEED]]

The paper gives no sensor parameter, seed or number of runs: what is compared is which rows are
critical and orders of magnitude, under the documented defaults. Prints Markdown for
docs/validation.md; every agreement stands beside the probability that chance gives it. RUNS
(20000) are those of architecture 1; the others take half or a quarter of them.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from sbas.fusion.architecture.architecture_files import load_architecture
from sbas.fusion.architecture.model import Architecture, FilterTuning, Redundancy
from sbas.fusion.critical.combination_figures import FEW_EVENTS
from sbas.fusion.critical.critical_times import (
    CriticalTimes,
    convexity_holds,
    critical_times,
    overlap_probability,
)
from sbas.fusion.critical.episodes import Episodes, extract_episodes, states_of_key
from sbas.fusion.critical.run_bootstrap import (
    drawn_runs,
    percentile_bounds,
    share_bounds,
    sums_over_runs,
)
from sbas.fusion.logic.published_tables import CRITICAL_TABLES, CRITICAL_TIMES, CriticalRows
from sbas.fusion.simulation.simulated_runs import simulate_runs
from sbas.fusion.states import NO_DATA, N, U

States = tuple[int, ...]


def analysed(architecture: Architecture, runs: int, seed: int) -> CriticalTimes:
    fused = simulate_runs(architecture, runs=runs, seed=seed)
    return critical_times(
        fused.sensor_state, fused.output_state, names=fused.names, step_s=fused.step_s,
        convex=convexity_holds(architecture), seed=seed,
    )  # fmt: skip


def receiver_alone(architecture: Architecture, runs: int, seed: int) -> CriticalTimes:
    """(phi, phi, U) is one combination, that lasts as long as the GPS receiver is in U."""
    fused = simulate_runs(architecture, runs=runs, seed=seed)
    return critical_times(
        fused.sensor_state[-1:], fused.output_state, names=fused.names[-1:], step_s=fused.step_s,
        seed=seed,
    )  # fmt: skip


def in_short(result: CriticalTimes, row: str) -> str:
    keys = {"incidence": "incidence", "U at entry": "p_u_at_entry", "mean tc, s": "event_mean_s"}
    return "; ".join(
        f"{name} {interval(result, row, key, 2 if key.endswith('_s') else 3)}"
        for name, key in keys.items()
    )


def interval(result: CriticalTimes, row: str, key: str, digits: int = 3) -> str:
    value, low, high = (result.table.loc[row, key + end] for end in ("", "_lower", "_upper"))
    if np.isnan(value):
        return "-"
    bounds = "" if np.isnan(low) else f" [{low:.{digits}f}, {high:.{digits}f}]"
    return f"{value:.{digits}f}{bounds}"


def overlap(result: CriticalTimes, rows: Iterable[str]) -> str:
    rows, critical = tuple(rows), result.critical
    hits = sum(row in critical for row in rows)
    whole = 3 ** len(result.names)
    p = overlap_probability(
        found=hits, critical=len([c for c in critical if "-" not in c]), rows=len(rows),
        combinations=whole,
    )  # fmt: skip
    verdict = "beyond chance" if p < 0.01 else "not beyond chance"
    return f"{len(critical)} critical, {hits}/{len(rows)} of the rows, p {p:.2g}: {verdict}"


def print_rows(
    table: CriticalRows, result: CriticalTimes, others: dict[str, CriticalTimes]
) -> None:
    print(f"\n### Table {table.number}, {table.architecture} "
          f"({', '.join(table.names)}; R = {result.runs}, seed {result.seed})\n")  # fmt: skip
    heads = ["row", "incidence", "U at entry", "mean tc, s", "5 % are U by, s", "verdict"]
    heads += [f"of {len(others)} other settings"]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for row in table.rows:
        cells = ["did not occur"] + ["-"] * 4
        if row in result.table.index:
            cells = [interval(result, row, k) for k in ("incidence", "p_u_at_entry")]
            cells += [interval(result, row, "event_mean_s", 1)]
            reach = result.table.loc[row, "reach_q05_s"]
            cells += ["-" if np.isnan(reach) else "never" if np.isinf(reach) else f"{reach:g}"]
            cells += [str(result.table.loc[row, "verdict"])]
        cells += [f"critical in {sum(row in o.critical for o in others.values())}"]
        print(f"| {','.join(row)} | {' | '.join(cells)} |")
    print(f"\n{overlap(result, table.rows)}; one run meets {result.visited_per_run:.1f} "
          f"combinations. Critical: {' '.join(result.critical)}.")  # fmt: skip
    for name, other in others.items():
        print(f"- {name} (R = {other.runs}, seed {other.seed}): {overlap(other, table.rows)}")
    print(*(f"- {finding.message}: {finding.evidence}" for finding in result.findings), sep="\n")


# --- pooled over combinations -----------------------------------------------------------------


def pooled(found: Episodes, wanted: Callable[[States], bool]) -> Iterator[str]:
    """Incidence, share at U on entry, and mean time of events, each with its interval."""
    keys = [k for k in np.unique(found.key).tolist() if wanted(states_of_key(k, found.sensors))]
    member = np.isin(found.key, keys)
    risk, event = member & found.at_risk, member & (found.outcome == 1)
    flags = [
        event, risk, member & found.there_at_entry, member & found.counted, event * found.steps,
    ]  # fmt: skip
    quantity = np.repeat(np.arange(len(flags)), found.run.size)
    sums = sums_over_runs(
        quantity, np.tile(found.run, len(flags)), np.concatenate(flags).astype(np.int64),
        quantities=len(flags), weights=drawn_runs(found.runs, replicates=1000, seed=0),
    )  # fmt: skip
    for name, part, whole in (("incidence", 0, 1), ("U at entry", 2, 3)):
        share = sums.drawn[part] / sums.drawn[whole]
        bounds = share_bounds(*sums.part_and_whole([part], [whole]), share[1:])
        yield f"{name} {share[0]:.3f} [{bounds[0]:.3f}, {bounds[1]:.3f}]"
    if sums.drawn[0, 0] < FEW_EVENTS:
        yield f"{sums.drawn[0, 0]:.0f} events, mean tc not estimable"
        return
    events = np.where(sums.drawn[0] > 0, sums.drawn[0], np.nan)
    mean = sums.drawn[4] / events * found.step_s
    low, high = percentile_bounds(mean[1:])
    yield f"mean tc {mean[0]:.2f} s [{low:.2f}, {high:.2f}]"


# --- architectures ----------------------------------------------------------------------------


def architecture_1(runs: int, seed: int) -> None:
    arch = load_architecture("arch1")
    result = analysed(arch, runs, seed)
    settings = {
        "weights with faults": replace(arch, weights="with_faults"),
        "equal weights": replace(arch, weights="fixed", fixed_weights=(1 / 3,) * 3),
        "weights per epoch": replace(arch, weights="per_epoch"),
    }
    others = {name: analysed(a, runs // 2, seed) for name, a in settings.items()}
    others |= {f"seed {s}": analysed(arch, runs, s) for s in (seed + 1, seed + 2)}
    print_rows(CRITICAL_TABLES[2], result, others)
    print("\n| statement | result |\n|---|---|")
    cells = [f"{k} {interval(result, 'UUN', f'event_{k}_s', 1)}" for k in ("mean", "median", "q05")]
    print(f"| (U,U,N): tc {CRITICAL_TIMES[0].shortest_s:g} s | {', '.join(cells)} s; "
          f"U at entry {interval(result, 'UUN', 'p_u_at_entry')} |")  # fmt: skip
    shares = [f"{row} {100 * result.table.loc[row, 'share_n']:.1f} %" for row in
              ("NNN", "NND", "NDN", "DNN", "NDD", "DND", "DDN")]  # fmt: skip
    print(f"| NNN, NND, NDN lead to N | epochs with output N: {', '.join(shares)} |")
    always = [name for name in result.table.index if result.table.loc[name, "share_u"] == 1]
    print(f"| 7 combinations always U | {len(always)}: {' '.join(always) or 'none'} |")


def architecture_1bis(runs: int, seed: int) -> None:
    arch = load_architecture("arch1bis")
    rows = CRITICAL_TIMES[1].rows
    gated = replace(arch, filter=replace(arch.filter, gate=6.63))
    print(f"\n### Architecture 1 bis, (phi, phi, U) critical, tc 1 to 3 s (R = {runs})\n")
    for name, a in (("no gate", arch), ("gate 6.63", gated)):
        result = analysed(a, runs, seed)
        table, text = result.table, overlap(result, rows)
        undecided = [row for row in rows if table.loc[row, "verdict"] == "undecided"]
        every = in_short(receiver_alone(a, runs, seed), "U")
        print(
            f"- {name}, seed {seed}: {text}; undecided rows: {' '.join(undecided) or 'none'}; "
            f"critical: {' '.join(result.critical)}\n  (phi, phi, U) as one: {every}"
        )
    within, entry = 0, []
    grid = list(itertools.product((0.03, 0.1, 0.3), (0.12, 0.3, 1.0, 3.0), (0.25, 0.75)))
    for acceleration, speed, position in grid:
        tuning = FilterTuning(acceleration, speed, position)
        table = receiver_alone(replace(arch, filter=tuning), runs // 5, seed).table
        within += bool(1 <= table.loc["U", "event_mean_s"] <= 3)
        entry.append(table.loc["U", "p_u_at_entry"])
    print(f"- {within} of {len(grid)} tunings (q .03, .1, .3; odometer .12, .3, 1, 3 m/s; fix .25, "
          f".75 m; R = {runs // 5}) have a mean tc of 1 to 3 s; U at entry "
          f"{100 * min(entry):.0f} to {100 * max(entry):.0f} %: the tuning decides")  # fmt: skip


def architecture_1ter(runs: int, seed: int) -> None:
    arch = load_architecture("arch1ter")
    pair = arch.redundancy[0].sensors
    shared = {s: replace(arch, redundancy=(Redundancy(pair, "per_run", s),)) for s in (0.0, 1.0)}
    others = {f"common share {s:g}": analysed(a, runs, seed) for s, a in shared.items()}
    others |= {f"seed {s}": analysed(arch, runs, s) for s in (seed + 1, seed + 2)}
    print_rows(CRITICAL_TABLES[3], analysed(arch, runs, seed), others)
    fused = simulate_runs(arch, runs=runs, seed=seed)
    found = extract_episodes(fused.sensor_state, fused.output_state, step_s=fused.step_s)
    # Where GPS is U it is its error that counts, whatever the odometers do.
    one = pooled(found, lambda s: set(s[:2]) == {N, U} and not {U, NO_DATA} & set(s[3:]))
    both = pooled(found, lambda s: s[0] == s[1] == U and not {U, NO_DATA} & set(s[3:]))
    print(f"- one odometer U, the other N, GPS N or DA: {', '.join(one)}")
    print(f"- both odometers U, GPS N or DA: {', '.join(both)}")


def architecture_2(runs: int, seed: int) -> None:
    arch = load_architecture("arch2")
    result = analysed(arch, runs, seed)
    others = {"norm of the axes": analysed(replace(arch, axis_rule="norm"), runs, seed)}
    others |= {f"seed {s}": analysed(arch, runs, s) for s in (seed + 1, seed + 2)}
    print_rows(CRITICAL_TABLES[4], result, others)
    cells = [f"{k} {interval(result, 'UUU', f'event_{k}_s', 2)}" for k in ("mean", "median")]
    print(f"- (U,U,U) not at once U, tc 1 s: U at entry {interval(result, 'UUU', 'p_u_at_entry')}, "
          f"else {', '.join(cells)} s")  # fmt: skip


def time_step(runs: int, seed: int) -> None:
    arch, bis = load_architecture("arch1"), load_architecture("arch1bis")
    # Rv = 1 m2/s2 at 0.1 s, where the filter leans on the fixes.
    bis = replace(bis, filter=replace(bis.filter, speed_mps=1.0))
    print(f"\n### Time step (R = {runs}, seed {seed})\n")
    print("| step, s | (U,N,D) of architecture 1 | GPS = U of 1 bis, Rv = 1 |\n|---|---|---|")
    for step_s in (1.0, 0.5, 0.2, 0.1):
        first = analysed(replace(arch, step_s=step_s), runs, seed)
        second = receiver_alone(replace(bis, step_s=step_s), runs, seed)
        print(f"| {step_s:g} | {in_short(first, 'UND')} | {in_short(second, 'U')} |")


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    begin = time.perf_counter()
    architecture_1(runs, seed)
    architecture_1bis(runs // 4, seed)
    architecture_1ter(runs // 2, seed)
    architecture_2(runs // 4, seed)
    time_step(runs // 4, seed)
    print(f"\n({time.perf_counter() - begin:.0f} s)")


if __name__ == "__main__":
    main()
