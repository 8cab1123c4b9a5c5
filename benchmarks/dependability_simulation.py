"""Simulation of hybrid fault trees: speed, and agreement with the exact solver on random models.

    python benchmarks/dependability_simulation.py [MODELS]

Prints slots/s and firings/s on the paper's system (compiled before), the rare rows by forced
failures, and the verdicts of 200 (or MODELS) random models by both simulations.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
# In place of this folder, whose coverage.py the compiler would take for the package coverage.
sys.path[0] = str(ROOT)

from sbas.dependability.exact.exact import solve  # noqa: E402
from sbas.dependability.simulation.agreement import agreement  # noqa: E402
from sbas.dependability.simulation.petri_simulation import simulate_net  # noqa: E402
from sbas.dependability.simulation.petri_translation import petri_net_of  # noqa: E402
from sbas.dependability.simulation.slot_simulation import simulate_model  # noqa: E402
from tests.dependability.paper_models import check_unit, localisation_unit  # noqa: E402
from tests.dependability.path_enumeration import random_model  # noqa: E402

HISTORIES = 20_000


def speed() -> None:
    for name, model in (("urban", localisation_unit()), ("check set", check_unit())):
        simulate_model(model, histories=2, rng=np.random.default_rng(0))
        start = time.perf_counter()
        simulate_model(model, histories=HISTORIES, rng=np.random.default_rng(1), force=())
        seconds = time.perf_counter() - start
        print(f"{name}: {HISTORIES * model.epochs / seconds:.3g} slots/s")
        for hardware in ("sampled", "continuous"):
            net = petri_net_of(model, hardware=hardware)  # type: ignore[arg-type]
            simulate_net(net, histories=2, rng=np.random.default_rng(0))
            start = time.perf_counter()
            found = simulate_net(net, histories=100, rng=np.random.default_rng(1))
            seconds = time.perf_counter() - start
            print(f"{name}, net, {hardware}: {found.firings / seconds:.3g} firings/s")


def rare_rows() -> None:
    force = [("ecs",), ("ecs", "antenna"), ("ecs", "receiver")]
    rng = np.random.default_rng(1)
    found = simulate_model(localisation_unit(), histories=140_000, rng=rng, force=force)
    for name, exact in (("IE1", 8.34e-11), ("IE6", 1.63e-8)):
        row = found.row(name)
        print(f"{name}: {row.mean:.4g} +- {row.mean_se:.2g}, published {exact:g}")


def random_models(count: int) -> None:
    verdicts: Counter[str] = Counter()
    for seed in range(count):
        model = random_model(seed)
        rows = solve(model, first_passage=True).rows.values()
        exact = {r.name: (r.mean_unavailability, r.at_least_once) for r in rows}
        slots = simulate_model(model, histories=HISTORIES, rng=np.random.default_rng(seed))
        net = simulate_net(
            petri_net_of(model), histories=HISTORIES, rng=np.random.default_rng(seed)
        )
        for kind, simulation in (("slots", slots), ("net", net)):
            for c in agreement(exact, simulation).comparisons:
                verdicts[f"{kind} {c.verdict}"] += 1
                if c.verdict == "disagrees":
                    print(seed, kind, c)
    print(f"{count} random models:", dict(verdicts))


if __name__ == "__main__":
    speed()
    rare_rows()
    random_models(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
