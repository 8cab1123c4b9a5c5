"""How long the exact solution of the paper's unit takes.

    python -m benchmarks.dependability_speed

Four chains of the receiver (the calibrated urban one and three with other shares of wrong and
missing output), step 1 s, mission 1 h. Prints seconds for means and points of all rows, and with
the first passage of every row, after one small solution that loads the libraries.
"""

from __future__ import annotations

import time

from sbas.dependability.exact.exact import solve
from tests.dependability.paper_models import (
    URBAN_EXACT,
    check_unit,
    default_rows,
    localisation_unit,
)

CHAINS = {
    "urban": URBAN_EXACT,
    "mostly missing": default_rows(0.0, 0.0, 0.8443, 0.936),
    "mostly wrong": default_rows(0.33, 0.74, 0.06, 0.4),
    "between": default_rows(0.1, 0.38, 0.02, 0.35),
}


def main() -> None:
    solve(check_unit(mission_s=60.0))
    for passages in (False, True):
        total = 0.0
        for name, rows in CHAINS.items():
            begin = time.perf_counter()
            solution = solve(localisation_unit(rows), first_passage=passages)
            seconds = time.perf_counter() - begin
            total += seconds
            what = "with first passages" if passages else "means and points"
            print(
                f"exact {name}, {what}, {len(solution.rows)} rows: {seconds:.3f} s "
                f"(top {solution.top.mean_unavailability:.6g})"
            )
        print(f"exact in all, {what}: {total:.2f} s")


if __name__ == "__main__":
    main()
