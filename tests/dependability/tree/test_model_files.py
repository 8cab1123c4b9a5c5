"""Models in files: round trips, units, refusals; the paper's system."""

from __future__ import annotations

import copy
import json
import math
import random
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from sbas.bundled import bundled
from sbas.dependability.tree.model import CausalAnd, Con, Dur, HybridFaultTree
from sbas.dependability.tree.model_check import check_model
from sbas.dependability.tree.model_files import dump_model, load_model, load_models, read_model_file
from sbas.dependability.tree.model_variants import build_models
from sbas.exceptions import InputError, ModelError
from tests.dependability.model_strategies import sound_models

TEXT = """
format = "sbas-dep"
version = 1
top = "top"
[meta]
name = "small"
[time]
step_s = 1
mission_s = 10
[[components]]
name = "A"
failure_rate_per_h = 2e-6
[[sources]]
name = "O"
states = ["right", "wrong"]
rows = [[0.5, 0.5], [1, 0]]
initial = [1, 0]
[[events]]
name = "a"
kind = "failed"
component = "A"
[[events]]
name = "w"
kind = "in_state"
source = "O"
states = ["wrong"]
[[gates]]
name = "run"
kind = "con"
count = 2
input = "w"
[[gates]]
name = "top"
kind = "or"
inputs = ["a", "run"]
"""
VARIED = (
    TEXT.replace("count = 2", 'count = "n"').replace("rows = [[0.5, 0.5], [1, 0]]\n", "")
    + """
[parameters]
n = 3
m = { value = 2, printed = 4, source = "a paper" }
[[rules]]
larger = "n"
smaller = "m"
message = "n exceeds m"
[environments.town.O]
rows = [[0.5, 0.5], [1, 0]]
[environments.field.O]
rows = [[0.75, 0.25], [1, 0]]
initial = [0, 1]
""".replace(
        "[parameters]",
        '[[gates]]\nname = "m"\nkind = "con"\ncount = "m"\ninput = "w"\n[parameters]',
    )
)


def file_of(folder: Path, text: str, name: str = "model.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@given(sound_models())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_written_is_read_again(tmp_path: Path, model: HybridFaultTree) -> None:
    for suffix in (".toml", ".json"):
        path = tmp_path / f"model{suffix}"
        dump_model(model, path)
        assert load_model(path) == model


def test_floats_are_written_with_the_fewest_digits_that_give_them_back(tmp_path: Path) -> None:
    model = load_model(file_of(tmp_path, TEXT))
    model = replace(model, components=(replace(model.components[0], failure_rate_per_h=0.1 + 0.2),))
    dump_model(model, tmp_path / "m.json")
    assert '"failure_rate_per_h": 0.30000000000000004' in (tmp_path / "m.json").read_text()
    dump_model(model, tmp_path / "m.toml")
    assert "failure_rate_per_h = 0.30000000000000004\n" in (tmp_path / "m.toml").read_text()


@pytest.mark.parametrize(
    ("text", "failure", "repair"),
    [
        ("failure_rate_per_h = 2e-6", 2e-6, 0.0),
        ("mtbf_h = 500000", 2e-6, 0.0),
        ("fit = 2000", 2e-6, 0.0),
        ("fit = 4\nmttr_h = 8", 4e-9, 0.125),
        ("mtbf_h = 4\nrepair_rate_per_h = 0.5", 0.25, 0.5),
    ],
)
def test_units_of_rates(tmp_path: Path, text: str, failure: float, repair: float) -> None:
    """1 FIT is 1e-9 per hour; a rate is the reciprocal of the mean time."""
    path = file_of(tmp_path, TEXT.replace("failure_rate_per_h = 2e-6", text))
    component = load_model(path).components[0]
    assert component.failure_rate_per_h == pytest.approx(failure, rel=1e-15)
    assert component.repair_rate_per_h == repair


@pytest.mark.parametrize(
    ("old", "new", "where", "words"),
    [
        ("failure_rate_per_h", "failure_rate", "components.A.failure_rate", "without unit"),
        ("failure_rate_per_h = 2e-6", "mtbf = 5", "components.A.mtbf", "mtbf_h"),
        ("failure_rate_per_h = 2e-6", "mtbf_h = 0", "components.A.mtbf_h", "more than 0"),
        ("failure_rate_per_h = 2e-6", "fit = 1\nmtbf_h = 1", "components.A.fit", "twice"),
        (
            "failure_rate_per_h = 2e-6",
            "",
            "components.A",
            "write failure_rate_per_h, mtbf_h or fit",
        ),
        ("failure_rate_per_h = 2e-6", "fit = nan", "components.A.fit", "out of range"),
        ("count = 2", "cuont = 2", "gates.run.cuont", "did you mean 'count'?"),
        ("count = 2", "", "gates.run.count", "write count"),
        ("count = 2", 'count = "k"', "gates.run.count", "integer"),
        ("count = 2", "count = 2.0", "gates.run.count", "integer"),
        ('kind = "con"', 'kind = "conn"', "gates.run.kind", "did you mean 'con'?"),
        ('kind = "con"\n', "", "gates.run.kind", "allowed are or, and"),
        ("version = 1", "version = 2", "format", "version 2"),
        ('format = "sbas-dep"', "", "format", "sbas-dep"),
        ("step_s = 1", "step = 1", "time.step", "step_s"),
        ("mission_s = 10", "mission_s = inf", "time.mission_s", "finite"),
        ('name = "small"', 'title = "small"', "meta.title", "name"),
        ("[meta]", "x-other = 1\n[meta]", "x-other", "JSON"),
        ("[time]", "[option]\n[time]", "option", "did you mean 'options'?"),
        ("[time]", "[options]\nrule = 1\n[time]", "options.rule", "dur_rule"),
        ("[time]", '[units]\nseconds = "h"\n[time]', "units", "s"),
        ('component = "A"', 'component = "B"', "events.a.component", "allowed are A"),
        ("[1, 0]]", "[1, 1]]", "sources.O.rows[1]", "sum 2.0"),
        ('name = "run"', "name = 7", "gates[0].name", "printable"),
        ("[[gates]]", "[gates]", "", "TOML"),
    ],
)
def test_refusals_name_file_key_and_cure(
    tmp_path: Path, old: str, new: str, where: str, words: str
) -> None:
    assert old in TEXT
    with pytest.raises(ModelError) as caught:
        load_model(file_of(tmp_path, TEXT.replace(old, new)))
    assert caught.value.where.startswith("model.toml")
    assert where in caught.value.where
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "no JSON"),
        ('{"a": 1, "a": 2}', "twice"),
        ('{"time": NaN}', "no number of JSON"),
        ("[]", "a table"),
        ("", "no JSON"),
        ('{"top": "t", "meta": {"name": "n"}, "time": 3, "format": "sbas-dep", "version": 1}',
         "a table"),
        ('{"top": "t", "meta": {"name": "n"}, "time": {}, "format": "sbas-dep", "version": 1}',
         "step_s"),
        ('{"top": "t", "gates": {}, "meta": {"name": "n"}, "time": {"step_s": 1, "mission_s": 1},'
         '"format": "sbas-dep", "version": 1}', "list of tables"),
        ("9" * 5000, "no JSON"),
    ],
)  # fmt: skip
def test_hostile_json_is_a_model_error(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        load_model(file_of(tmp_path, text, "model.json"))


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ModelError, match="no TOML"):
        load_model(path)
    with pytest.raises(InputError, match="cannot be read"):
        load_model(tmp_path / "absent.toml")
    with pytest.raises(InputError, match=r"\.toml or \.json"):
        load_model(tmp_path / "model.xml")
    with pytest.raises(InputError, match="no bundled model") as caught:
        load_model("galoro")
    assert "did you mean 'galoroi'?" in caught.value.cure


def test_a_path_of_keys_is_a_model_error(tmp_path: Path) -> None:
    deep = ".".join(["a"] * 2000)
    for text in (f"{deep} = 1\n{TEXT}", f"{TEXT}\n[meta.{deep}]\n"):
        with pytest.raises(ModelError, match="too deep"):
            load_model(file_of(tmp_path, text))


def test_keys_of_other_programs_stay_in_the_notes(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    dump_model(load_model(file_of(tmp_path, TEXT)), path)
    table = json.loads(path.read_text())
    path.write_text(json.dumps({**table, "x-tool": {"at": [1, 2]}}))
    model = load_model(path)
    assert model.notes == ('x-tool = {"at": [1, 2]}',)
    dump_model(model, path)
    assert load_model(path) == model


def test_only_sound_models_are_written(tmp_path: Path) -> None:
    model = load_model(file_of(tmp_path, TEXT))
    with pytest.raises(ModelError, match="out of range"):
        dump_model(replace(model, step_s=float("nan")), tmp_path / "m.json")
    with pytest.raises(ModelError, match="UTF-8"):
        dump_model(replace(model, notes=("\ud800",)), tmp_path / "m.json")
    with pytest.raises(InputError, match=r"\.toml or \.json"):
        dump_model(model, tmp_path / "m.xml")


# --- parameters and environments --------------------------------------------------------------


def test_environments_and_parameters(tmp_path: Path) -> None:
    path = file_of(tmp_path, VARIED)
    models = load_models(path)
    assert list(models) == ["town", "field"]
    assert models["field"].sources[0].rows[0] == (0.75, 0.25)
    assert models["field"].sources[0].initial == (0.0, 1.0)
    assert models["town"].sources[0].initial == (1.0, 0.0)
    assert models["town"].name == "small, town"
    assert models["town"].gates[0] == Con("run", 3, "w")
    model = load_model(path, environment="town", parameters={"n": 5})
    assert model.gates[0] == Con("run", 5, "w")
    assert model.notes == ("n = 5 on request: the file has 3", "m = 2, not 4 as printed: a paper")
    with pytest.raises(InputError, match="several environments"):
        load_model(path)
    with pytest.raises(InputError, match="no environment 'twon'"):
        load_model(path, environment="twon")
    with pytest.raises(InputError, match="no parameter 'k'"):
        load_model(path, environment="town", parameters={"k": 5})
    assert list(load_models(file_of(tmp_path, TEXT))) == ["small"]


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ('smaller = "m"', 'smaller = "k"', "rules[0].smaller"),
        ("n = 3", "n = -3", "parameters.n.value"),
        ("n = 3", "n = 3\nz = 4", "parameters.z"),
        ("[environments.town.O]", "[environments.town.P]", "environments.town.P"),
        ("printed = 4", "print = 4", "parameters.m.print"),
        ("initial = [0, 1]", "published = {}", "environments.field.O.rows"),
        ("initial = [0, 1]", "name = 'P'", "environments.field.O.name"),
        ("n = 3", "n = 2", "parameters.n"),
    ],
)
def test_variants_that_mean_nothing(tmp_path: Path, old: str, new: str, where: str) -> None:
    with pytest.raises(ModelError) as caught:
        load_models(file_of(tmp_path, VARIED.replace(old, new)))
    assert caught.value.where == f"model.toml: {where}"


JUNK: list[Any] = [
    None, True, -1, 0, 2, 1.5, math.nan, math.inf, 10**400, "", "k", "A", [], [1], [[1]], {},
    {"a": 1}, [{}], [None], ["BE1"], [{"name": "A"}], [[0.5, 0.5, 0.0]],
]  # fmt: skip


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    for key, below in pairs:
        yield (*path, key)
        if isinstance(below, dict | list):
            yield from places(below, (*path, key))


@pytest.mark.parametrize("calibrated", [False, True])
def test_a_file_with_junk_in_it_gives_a_package_error_and_nothing_else(calibrated: bool) -> None:
    text = bundled("models", "galoroi.toml").read_text()
    good = tomllib.loads(text)
    good["environments"] = {"urban": good["environments"]["urban"]}
    if not calibrated:
        good["environments"] = {"urban": {"O": {"rows": [[0.5, 0.25, 0.25]] * 3}}}
    chance = random.Random(4)
    everywhere = list(places(good))
    refused = 0
    for _ in range(100 if calibrated else 1000):
        table = copy.deepcopy(good)
        *above, last = chance.choice(everywhere)
        inside: Any = table
        for key in above:
            inside = inside[key]
        if chance.random() < 0.2:
            del inside[last]
        else:
            inside[last] = chance.choice(JUNK)
        try:
            build_models(table)
        except (ModelError, InputError):
            refused += 1
    assert refused > 50


# --- the paper's system -----------------------------------------------------------------------


def test_the_papers_system_is_as_its_table_1_says() -> None:
    """Nguyen, Beugin, Marais 2013, Table I: rates, T1, T2, and k, l as its text demands."""
    models = load_models("galoroi")
    assert list(models) == ["urban", "tunnel", "woody", "cutting"]
    for model in models.values():
        rates = {c.name: c.failure_rate_per_h for c in model.components}
        assert rates == {"A": 4e-6, "R": 4.08e-6, "E": 2e-6, "fusion": 6.06e-6}
        assert {c.repair_rate_per_h for c in model.components} == {1 / 24}
        gates = {g.name: g for g in model.gates}
        assert gates["IE1"] == CausalAnd("IE1", 3.0, ("BE2", "IE3"))
        assert gates["IE2"] == Dur("IE2", 60.0, "IE3")
        assert gates["IE5"] == Con("IE5", 6, "BE6")
        assert gates["L"] == Con("L", 2, "BE6")
        assert model.sources[0].first_fix_s == 180.0
        assert model.epochs == 3600
        assert [f.where for f in check_model(model)] == ["events.UE"]
        assert any("calibrated, not published" in note for note in model.notes)


def test_the_urban_chain_is_the_calibrated_one() -> None:
    """Section 10.5 of the method page prints these rows to ten digits."""
    rows = load_model("galoroi", environment="urban").sources[0].rows
    printed = ((0.9549983983, 0.0383925705, 0.0066090312),
               (0.6816736700, 0.3123126308, 0.0060136991),
               (0.7455557479, 0.0420252194, 0.2124190327))  # fmt: skip
    for row, expected in zip(rows, printed, strict=True):
        assert row == pytest.approx(expected, abs=6e-11)


def test_the_loader_warns_of_the_printed_counts_and_refuses_them() -> None:
    file = read_model_file("galoroi", environments=("urban",))
    messages = [f.message for f in file.findings if f.severity == "warning"]
    assert "k = 6, not 2 as printed" in messages
    assert "l = 2, not 6 as printed" in messages
    assert any("Table I prints k = 2 and l = 6" in n for n in file.models["urban"].notes)
    with pytest.raises(ModelError, match="prints k = 2 and l = 6 by mistake") as caught:
        load_models("galoroi", parameters={"k": 2, "l": 6})
    assert caught.value.evidence == "k = 2, l = 6"
    as_printed = load_model(
        "galoroi", environment="urban", parameters={"k": 2, "l": 6}, override_rules=True
    )
    assert any("by mistake" in note for note in as_printed.notes)
    # The chain is the environment's: what is asked of it does not change it.
    assert as_printed.sources == file.models["urban"].sources


def test_the_dumped_system_needs_no_calibration(tmp_path: Path) -> None:
    model = load_model("galoroi", environment="tunnel")
    dump_model(model, tmp_path / "tunnel.json")
    assert load_model(tmp_path / "tunnel.json") == model
