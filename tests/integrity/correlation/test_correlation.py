"""The question, from recordings to answers: known processes, the real hour, bad input."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

import sbas
from sbas.estimate import Estimate, Refusal
from sbas.integrity.correlation.correlation import decorrelation, decorrelation_of
from sbas.integrity.correlation.decorrelation_results import Decorrelation
from sbas.logs.arrow import parquet_writer
from sbas.recording import Recording
from tests.examples import POINT, recording

N = 30_000


def gauss_markov(tau: float, n: int = N, seed: int = 1) -> np.ndarray:
    rho = math.exp(-1 / tau)
    noise = np.random.default_rng(seed).standard_normal((2, n))
    noise[:, 1:] *= math.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], noise)


def recorded(errors: np.ndarray, **columns: np.ndarray) -> Recording:
    return recording(*errors, np.full(errors.shape[1], 11.0), **columns)


@pytest.fixture(autouse=True, scope="module")
def _fewer_simulated_records() -> Iterator[None]:
    """Quick intervals, a little wider: their coverage is tested elsewhere."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sbas.integrity.correlation.tau_interval.FEWEST", 150)
        patch.setattr("sbas.integrity.correlation.tau_interval.SIMULATED_SAMPLES", 1 << 20)
        patch.setattr("sbas.integrity.correlation.tau_interval.MOST", 400)
        yield


@pytest.fixture(scope="module")
def usual(_fewer_simulated_records: None) -> tuple[Recording, Decorrelation]:
    source = recorded(0.7 * gauss_markov(60.0))
    return source, decorrelation(source, truth=POINT)


def test_a_gauss_markov_record_gives_its_tau(usual: tuple[Recording, Decorrelation]) -> None:
    _, result = usual
    assert isinstance(result.tau_s, Estimate)
    assert result.tau_s.evidence == "modelled"
    assert result.tau_low_s < 60 < result.tau_high_s
    assert result.misfit == "gm1"
    assert result.verdict_on_360_s == "shorter"
    assert set(result.component_tau_s) == {"east", "north"}
    for name in ("robust_fit_s", "first_1_over_e_s", "crossing_0_05_third_s", "ar1_lag1_s"):
        assert result.definitions[name] == pytest.approx(60, rel=0.35), name
    assert result.samples == N
    assert result.findings == ()


def test_no_truth_a_constant_error_and_a_scale_change_nothing(
    usual: tuple[Recording, Decorrelation],
) -> None:
    source, result = usual
    own = decorrelation(source)
    assert own.tau_low_s == pytest.approx(result.tau_low_s, rel=1e-4)
    assert own.tau_s.value == pytest.approx(result.tau_s.value, rel=1e-4)
    assert [f.code for f in own.findings] == ["E01"]
    shifted = decorrelation(recorded(1.4 * gauss_markov(60.0) + 5))
    assert shifted.tau_s.value == pytest.approx(result.tau_s.value, rel=1e-3)


def test_streaming_from_a_file_gives_the_same(
    usual: tuple[Recording, Decorrelation], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, result = usual
    parquet_writer.write([source], tmp_path / "a.parquet")
    streamed = decorrelation(sbas.scan(tmp_path / "a.parquet"), truth=POINT)
    monkeypatch.setattr("sbas.integrity.correlation.error_grid.IN_MEMORY_BYTES", 1000)
    in_file = decorrelation(source, truth=POINT)
    for other in (streamed, in_file):
        assert other.tau_s == result.tau_s
        assert other.definitions == result.definitions


def test_a_mixture_is_flagged_and_taken_apart() -> None:
    mixed = (gauss_markov(10.0, 100_000, 2) + gauss_markov(500.0, 100_000, 3)) / math.sqrt(2)
    result = decorrelation_of(mixed.astype(np.float32), 1.0)
    assert result.misfit == "mixture"
    assert result.verdict_on_360_s == "cannot_be_told"
    assert "one time constant does not describe" in result.verdict_text
    assert any("one Gauss-Markov" in c for c in result.tau_s.caveats)
    two = result.two_processes
    assert two.tau_1_s == pytest.approx(10, rel=0.25)
    assert two.tau_2_s == pytest.approx(500, rel=0.5)
    assert two.tau_short_s == pytest.approx(1 / (0.5 / 10 + 0.5 / 500), rel=0.25)


def test_a_smooth_process_is_flagged() -> None:
    a = 100 / 2.146193
    noise = np.random.default_rng(4).standard_normal((2, 100_000))
    rho = math.exp(-1 / a)
    smooth = lfilter([1.0], [1.0, -2 * rho, rho**2], noise)
    result = decorrelation_of((smooth / smooth.std()).astype(np.float32), 1.0)
    assert result.misfit == "smooth"


def test_bursts_do_not_pass_for_a_second_process() -> None:
    x = gauss_markov(100.0, 100_000, 5)
    for start in range(1000, 100_000, 5000):
        x[:, start : start + 30] += 30
    result = decorrelation_of(x.astype(np.float32), 1.0)
    assert result.clipped >= 600
    assert result.misfit == "gm1"
    assert result.tau_low_s < 100 < result.tau_high_s


def test_white_noise_has_no_tau() -> None:
    white = np.random.default_rng(6).standard_normal((2, 5000))
    result = decorrelation_of(white.astype(np.float32), 1.0)
    assert result.misfit == "mostly_white"
    assert isinstance(result.tau_s, Refusal)
    assert result.tau_low_s is None


def test_the_real_hour_is_too_short_for_360_s(reference_data: Path) -> None:
    source = sbas.read(reference_data / "data/egnos_debrecen_2016194/debr194m.pos")
    result = decorrelation(source)
    assert result.misfit == "record_too_short"
    assert isinstance(result.tau_s, Refusal)
    assert result.tau_low_s < 360 < (result.tau_high_s or math.inf)
    assert "too short to confirm or reject 360 s" in result.verdict_text
    assert "E15" in [f.code for f in result.findings]
    plain = result.to_dict()
    assert plain["tau_s"] is None
    assert plain["tau_low_s"] == result.tau_low_s
    assert plain["misfit"] == "record_too_short"


def test_segments_by_time_and_by_environment() -> None:
    quick, slow = gauss_markov(10.0, 8000, 7), gauss_markov(100.0, 8000, 8)
    x = np.concatenate([quick, slow], axis=1)
    labels = pd.Categorical(["open"] * 8000 + ["cutting"] * 8000)
    source = recorded(x, environment=labels)
    by_label = decorrelation(source, segments="environment").pieces
    by_time = decorrelation(source, segments=8000.0).pieces
    named = {p.label: p for p in by_label}
    assert set(named) == {"open", "cutting"}
    assert [p.samples for p in by_time] == [8000, 8000]
    for first, second in ((named["open"], named["cutting"]), by_time):
        assert first.tau_low_s < 10 < first.tau_high_s
        assert second.tau_low_s < 100 < second.tau_high_s
        assert first.tau_high_s < second.tau_low_s
    none = decorrelation(recorded(quick), segments="environment")
    assert none.pieces == ()
    assert "E25" in [f.code for f in none.findings]


def bad(kind: str) -> Recording:
    still = gauss_markov(10.0, 3000, 9)
    source = recorded(still)
    table = source.table
    if kind == "constant":
        return recorded(np.zeros((2, 3000)))
    if kind == "all gaps":
        return source.replace(table=table.assign(lat_deg=np.nan, lon_deg=np.nan))
    if kind == "ten epochs":
        return source.replace(table=table.iloc[:10])
    if kind == "one epoch":
        return source.replace(table=table.iloc[:1])
    if kind == "nothing":
        return source.replace(table=table.iloc[:0])
    if kind == "repeated":
        return source.replace(table=table.iloc[np.sort(np.r_[:3000, 50])])
    if kind == "backward":
        return source.replace(table=table.iloc[::-1])
    assert kind == "moving"
    return source.replace(table=table.assign(lat_deg=table["lat_deg"] + np.linspace(0, 1, 3000)))


@pytest.mark.parametrize(
    ("kind", "code", "word"),
    [
        ("constant", "E10", "does not change"),
        ("all gaps", "E01", "no positions"),
        ("ten epochs", "E15", "10 epochs"),
        ("one epoch", "E15", "1 epoch"),
        ("nothing", "E15", "no epoch"),
        ("repeated", "E05", "repeat"),
        ("backward", "E14", "backward"),
        ("moving", "E01", "moves"),
    ],
)
def test_bad_input_gives_findings_not_numbers(kind: str, code: str, word: str) -> None:
    result = decorrelation(bad(kind))
    assert isinstance(result.tau_s, Refusal)
    assert word in result.tau_s.reason
    assert code in [f.code for f in result.findings]
    plain = result.to_dict()
    json.dumps(plain, allow_nan=False)
    numbers = ("tau_s", "tau_low_s", "tau_high_s", "nugget", "misfit", "definitions")
    assert [plain[key] for key in numbers] == [None] * 6
    assert plain["verdict_on_360_s"] == "cannot_be_told"
    assert "cannot be told" in str(result)


def test_all_gaps_with_truth_and_arguments_out_of_range() -> None:
    result = decorrelation(bad("all gaps"), truth=POINT)
    assert isinstance(result.tau_s, Refusal)
    assert "0 epochs" in result.tau_s.reason
    source = bad("ten epochs")
    for options in ({"confidence": 1.0}, {"segments": "hour"}, {"segments": -5.0}):
        with pytest.raises(sbas.InputError):
            decorrelation(source, **options)


def test_text_table_and_json(usual: tuple[Recording, Decorrelation]) -> None:
    _, result = usual
    text = str(result)
    assert "gm1" in text
    assert "first lag with r below 1/e" in text
    table = result.summary()
    assert table.loc[("whole", "tau_s"), "value"] == result.tau_s.value
    assert table.loc[("whole", "tau_s"), "upper"] == result.tau_high_s
    plain = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert plain["tau_s"] == result.tau_s.value
    assert plain["estimate"]["evidence"] == "modelled"
