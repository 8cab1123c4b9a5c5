"""How often the first-named cause of an injected event is right.

    python -m benchmarks.causes [SEEDS]

Every kind of cause is put into SEEDS (default 50) clean laboratory recordings, among changes
that have nothing to do with it (tests/integrity/cause_cases.py). Prints the share named right.
"""

from __future__ import annotations

import sys
import time
from collections import Counter

from tests.integrity.causes.cause_cases import KINDS, explained


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    begin, right = time.perf_counter(), 0
    for kind in KINDS:
        found = [explained(kind, seed) for seed in range(seeds)]
        names = Counter("no event" if event is None else event.cause for event in found)
        right += names[kind]
        wrong = ", ".join(f"{n} {name}" for name, n in names.items() if name != kind)
        print(f"causes {kind}: {names[kind]} of {seeds}" + (f" (else {wrong})" if wrong else ""))
    total = seeds * len(KINDS)
    print(
        f"causes in all: {right} of {total}, {100 * right / total:.1f} % "
        f"({time.perf_counter() - begin:.1f} s)"
    )


if __name__ == "__main__":
    main()
