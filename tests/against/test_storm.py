"""Exports against Storm; skipped where stormpy is not installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from sbas.dependability.exact.exact import solve
from sbas.dependability.exchange.explicit_chain import explicit_chain, lab_text, tra_text
from sbas.dependability.exchange.galileo_export import galileo_text
from sbas.dependability.exchange.pnpro import pnpro_text
from sbas.dependability.simulation.petri_net import Arc, Exponential, PetriNet, Place
from sbas.dependability.tree.model import AtLeast, Component, Failed, HybridFaultTree, Or, Pand
from tests.dependability.exchange.hybrid_models import with_memory

stormpy = pytest.importorskip("stormpy", reason="stormpy is not installed: pip install stormpy")


def test_first_passage_by_storm(tmp_path: Path) -> None:
    model = with_memory()
    exported = explicit_chain(model)
    tra, lab = tmp_path / "m.tra", tmp_path / "m.lab"
    tra.write_text(tra_text(exported.chain), encoding="utf-8")
    lab.write_text(lab_text(exported.chain), encoding="utf-8")
    chain = stormpy.build_model_from_explicit(str(tra), str(lab))
    steps = model.epochs + exported.extra_steps
    (asked,) = stormpy.parse_properties(f'P=? [F<={steps} "top"]')
    theirs = stormpy.model_checking(chain, asked).get_value(chain.initial_states[0])
    ours = solve(model, first_passage=True, names=["T"]).top.at_least_once
    assert theirs == pytest.approx(ours, rel=1e-12)


def test_an_unrepaired_tree_by_storm(tmp_path: Path) -> None:
    """Storm works in continuous time; epochs of 0.5 s in an hour lie within 2e-4 of it."""
    dft = pytest.importorskip("stormpy.dft", reason="this stormpy is built without fault trees")
    names = "ABCD"
    model = HybridFaultTree(
        "tree", 0.5, 3600,
        tuple(Component(f"{n}-hardware", r) for n, r in zip(names, (0.5, 0.7, 0.2, 0.9),
                                                            strict=True)), (),
        tuple(Failed(n, f"{n}-hardware") for n in names),
        (Pand("P", ("A", "B"), False, False), AtLeast("V", 2, ("A", "C", "D")),
         Or("T", ("P", "V"))), "T",
    )  # fmt: skip
    file = tmp_path / "m.dft"
    file.write_text(galileo_text(model, time_unit="h").text, encoding="utf-8")
    tree = dft.prepare_for_analysis(dft.load_dft_galileo_file(str(file)))
    (theirs,) = dft.analyze_dft(tree, stormpy.parse_properties('P=? [F<=1 "failed"]'))
    assert theirs == pytest.approx(solve(model, names=["T"]).top.at_end, rel=2e-4)


def test_storm_reads_the_project_of_a_net(tmp_path: Path) -> None:
    gspn = pytest.importorskip("stormpy.gspn", reason="this stormpy is built without Petri nets")
    net = PetriNet(
        "unit", (Place("up", 1), Place("failed")),
        (Exponential(name="fails", rate_per_h=2.0, inputs=(Arc("up"),), outputs=(Arc("failed"),)),
         Exponential(name="is repaired", rate_per_h=3.0, inputs=(Arc("failed"),),
                     outputs=(Arc("up"),))), 3600.0,
    )  # fmt: skip
    file = tmp_path / "net.pnpro"
    file.write_text(pnpro_text(net).text, encoding="utf-8")
    read = gspn.load_gspn_file(str(file))
    assert sorted(place.get_name() for place in read.get_places()) == ["failed", "up"]
    rates = {t.get_name(): t.get_rate() for t in read.get_timed_transitions()}
    assert rates["is_repaired"] == pytest.approx(3.0 / 3600, rel=1e-15)
