"""Models of every format behind one door."""

from __future__ import annotations

from pathlib import Path

import pytest

from sbas.dependability.exchange.open_psa_export import open_psa_text
from sbas.dependability.model_input import load_any
from sbas.dependability.static.static_tree import BasicEvent, StaticGate, StaticTree
from sbas.dependability.tree.model import Component, Failed, HybridFaultTree, Or
from sbas.dependability.tree.model_files import dump_model
from sbas.exceptions import InputError, ModelError

MODEL = HybridFaultTree(
    "pair", 1.0, 3600.0, (Component("a", 1e-5, 0.1), Component("b", 2e-5)), (),
    (Failed("a-failed", "a"), Failed("b-failed", "b")),
    (Or("top", ("a-failed", "b-failed")),), "top",
)  # fmt: skip


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_own_files_come_back(tmp_path: Path, suffix: str) -> None:
    dump_model(MODEL, tmp_path / f"pair{suffix}")
    (model,) = load_any(tmp_path / f"pair{suffix}").models.values()
    assert model == MODEL
    (longer,) = load_any(tmp_path / f"pair{suffix}", mission_s=7200.0, step_s=2.0).models.values()
    assert (longer.mission_s, longer.step_s, longer.epochs) == (7200.0, 2.0, 3600)


def test_open_psa_with_rates_is_a_hybrid_tree(tmp_path: Path) -> None:
    (tmp_path / "pair.xml").write_text(open_psa_text(MODEL).text, encoding="utf-8")
    loaded = load_any(tmp_path / "pair.xml")
    (model,) = loaded.models.values()
    assert loaded.losses is not None
    assert {c.failure_rate_per_h for c in model.components} == {1e-5, 2e-5}
    assert model.top == "top"


def test_open_psa_with_probabilities_is_a_static_tree(tmp_path: Path) -> None:
    tree = StaticTree("s", (BasicEvent("a", 0.25),), (StaticGate("top", "and", ("a",)),), "top")
    (tmp_path / "s.xml").write_text(open_psa_text(tree).text, encoding="utf-8")
    loaded = load_any(tmp_path / "s.xml")
    assert loaded.models == {}
    assert loaded.static is not None
    assert loaded.static.events[0].probability == 0.25


def test_a_galileo_file_asks_for_what_it_does_not_say(tmp_path: Path) -> None:
    file = tmp_path / "t.dft"
    file.write_text('toplevel "T";\n"T" or "a" "b";\n"a" lambda=0.001;\n"b" lambda=0.002;\n')
    with pytest.raises(InputError, match="unit of time"):
        load_any(file)
    (model,) = load_any(file, time_unit="min", mission_s=600.0).models.values()
    assert sorted(c.failure_rate_per_h for c in model.components) == pytest.approx([0.06, 0.12])


def test_what_is_no_model_says_so(tmp_path: Path) -> None:
    with pytest.raises((InputError, ModelError)):
        load_any(tmp_path / "none.toml")
    with pytest.raises((InputError, ModelError), match="environment"):
        load_any("galoroi", environment="moon")
    bomb = tmp_path / "bomb.xml"
    bomb.write_text('<!DOCTYPE x [<!ENTITY a "aaaa">]><opsa-mef>&a;</opsa-mef>')
    with pytest.raises(InputError):
        load_any(bomb)


def test_another_step_would_change_what_the_rows_of_a_source_mean() -> None:
    with pytest.raises(InputError, match="rows of a source"):
        load_any("galoroi", environment="urban", step_s=0.5)
    (same,) = load_any("galoroi", environment="urban", step_s=1.0).models.values()
    assert same.step_s == 1.0


def test_a_note_on_calibrated_rows_stays_true_under_other_parameters() -> None:
    (plain,) = load_any("galoroi", environment="urban").models.values()
    (other,) = load_any("galoroi", environment="urban", parameters={"k": 4}).models.values()
    (note,) = (n for n in plain.notes if "by construction" in n)
    (changed,) = (n for n in other.notes if "by construction" in n)
    assert changed.startswith(note)
    assert "not with those given here" in changed


def test_rates_without_a_mission_ask_for_it(tmp_path: Path) -> None:
    rate = tmp_path / "rate.xml"
    rate.write_text(
        '<opsa-mef><define-fault-tree name="t"><define-gate name="g"><or>'
        '<basic-event name="a"/></or></define-gate></define-fault-tree><model-data>'
        '<define-basic-event name="a"><exponential><float value="1e-3"/>'
        "<system-mission-time/></exponential></define-basic-event></model-data></opsa-mef>"
    )
    with pytest.raises((InputError, ModelError), match="mission"):
        load_any(rate)
    loaded = load_any(rate, mission_s=3600.0, step_s=1.0)
    assert [c.failure_rate_per_h for m in loaded.models.values() for c in m.components] == [1e-3]
