"""How often damaged files get the right finding, and whether any gives a wrong figure without one.

    python -m benchmarks.corruption [PART OF A NAME ...]

Runs the corpus of tests/corruption (or the cases whose names hold one of the parts), prints every
case that is not right, the table of kinds by families of formats and the score. A file that takes
longer than `LIMIT_S` counts as hanging.
"""

from __future__ import annotations

import signal
import sys
import time
from collections import Counter
from types import FrameType

from tests.corruption.corpus import KINDS, Case, cases
from tests.corruption.verdict import Verdict, judged

LIMIT_S = 30.0


def _give_up(number: int, frame: FrameType | None) -> None:
    raise TimeoutError(f"longer than {LIMIT_S:g} s")


def _limited(case: Case) -> Verdict:
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    try:
        return judged(case)
    except TimeoutError as hang:
        return Verdict("crash", detail=str(hang))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def main() -> None:
    parts = sys.argv[1:]
    begin = time.perf_counter()
    signal.signal(signal.SIGALRM, _give_up)
    outcomes: Counter[str] = Counter()
    by_kind: dict[str, Counter[str]] = {kind.name: Counter() for kind in KINDS}
    slowest = (0.0, "")
    for case in cases():
        if parts and not any(part in case.name for part in parts):
            continue
        start = time.perf_counter()
        verdict = _limited(case)
        slowest = max(slowest, (time.perf_counter() - start, case.name))
        outcomes[verdict.outcome] += 1
        by_kind[case.kind.name][case.log.form.family] += 1
        by_kind[case.kind.name]["right"] += verdict.outcome == "right"
        if verdict.outcome != "right":
            print(f"{verdict.outcome}: {case.name}: {verdict.said} {verdict.detail}", flush=True)
    print("kind: right of all (framed, text, table)")
    for name, counts in by_kind.items():
        families = [counts[family] for family in ("framed", "text", "table")]
        if total := sum(families):
            print(f"{name}: {counts['right']} of {total} ({', '.join(map(str, families))})")
    total = sum(outcomes.values())
    print(
        f"corruption in all: {outcomes['right']} of {total} right, "
        f"{100 * outcomes['right'] / max(total, 1):.2f} %; {dict(outcomes)}; "
        f"{time.perf_counter() - begin:.0f} s, slowest {slowest[0]:.1f} s ({slowest[1]})"
    )


if __name__ == "__main__":
    main()
