"""Whole-process speed and memory of the acceptance cases.

    python benchmarks/run.py            # everything; the year takes some minutes to simulate
    python benchmarks/run.py report     # one case of: sbf, text, report, year, coverage

Files are made in a temporary folder and removed; nothing is asserted here.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).parent
SBAS = str(Path(sys.executable).parent / "sbas")
TRUTH = "50.03,15.77,289.4"


def timed(*command: str) -> tuple[float, float]:
    """Wall seconds and peak memory [GB] of a command as a whole process."""
    code = (
        "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, "
        "stdout=subprocess.DEVNULL); "
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    begin = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-S", "-c", code, *command], check=True, capture_output=True, text=True
    )
    return time.perf_counter() - begin, int(done.stdout) * 1024 / 1e9


def median_of(runs: int, *command: str) -> str:
    results = sorted(timed(*command) for _ in range(runs))
    peak = max(memory for _, memory in results)
    return f"median {results[runs // 2][0]:.2f} s of {runs} runs, peak {peak:.2f} GB"


def sbf(folder: Path) -> None:
    subprocess.run([sys.executable, str(HERE / "sbf_speed.py")], check=False)


def text(folder: Path) -> None:
    subprocess.run([sys.executable, str(HERE / "text_speed.py")], check=True)


def report(folder: Path) -> None:
    record, page = folder / "lab.sbf", folder / "lab.html"
    timed(SBAS, "simulate", "--out", str(record), "--quiet")
    figure = median_of(
        5, SBAS, "evaluate", str(record), "--truth", TRUTH, "--report", str(page), "--quiet"
    )
    print(f"report   {record.stat().st_size / 1e6:.1f} MB of SBF to a report of "
          f"{page.stat().st_size / 1e6:.2f} MB: {figure}")  # fmt: skip


def year(folder: Path) -> None:
    record = folder / "year.parquet"
    seconds, memory = timed(SBAS, "simulate", "--hours", "8750", "--out", str(record), "--quiet")
    print(f"year     simulated in {seconds:.0f} s, peak {memory:.2f} GB, "
          f"{record.stat().st_size / 1e9:.2f} GB of Parquet")  # fmt: skip
    figure = median_of(3, SBAS, "evaluate", str(record), "--truth", TRUTH, "--json", "--quiet")
    print(f"year     3.15e7 epochs evaluated: {figure}")


def coverage(folder: Path) -> None:
    subprocess.run([sys.executable, str(HERE / "counted_coverage.py")], check=True)


CASES: tuple[Callable[[Path], None], ...] = (sbf, text, report, coverage, year)


def main() -> None:
    wanted = sys.argv[1:] or [case.__name__ for case in CASES]
    for case in CASES:
        if case.__name__ in wanted:
            with tempfile.TemporaryDirectory() as folder:
                case(Path(folder))


if __name__ == "__main__":
    main()
