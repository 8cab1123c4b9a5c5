"""The simulated recording: what was asked for is in it, and nothing depends on the pieces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pymap3d
import pytest

from sbas.exceptions import InputError, ModelError
from sbas.laboratory import LaboratorySettings, bundled_settings, simulate, simulate_pieces
from sbas.laboratory.constellation import SLOTS_27, satellite_enu_m, slot_harmonics
from sbas.recording import COLUMNS, Flag, RecordingMeta, major_semi_axis_m

BUSY = LaboratorySettings(
    hours=3.0, gaps_per_day=100.0, hpl_outliers_per_day=100.0, satellite_losses_per_day=100.0,
    failure_rate_per_h=2.0, white_share=0.1, seed=5,
)  # fmt: skip


def errors_m(recording, settings):
    """East, north, up errors by pymap3d from the truth of the settings."""
    t = recording.table
    return np.array(
        pymap3d.geodetic2enu(
            t["lat_deg"].to_numpy(), t["lon_deg"].to_numpy(), t["height_m"].to_numpy(),
            settings.lat_deg, settings.lon_deg, settings.height_m,
        )
    )  # fmt: skip


def kinds(recording, kind):
    injected = recording.side_tables["injected"]
    return injected[injected["kind"] == kind]


def epochs_of(recording, event, interval_s=1.0):
    """Mask of the epochs within one injected event."""
    since = (recording.time - event.time.to_datetime64()) / np.timedelta64(1, "ns") * 1e-9
    return (since >= 0) & (since < event.duration_s - interval_s / 2)


@pytest.fixture(scope="module")
def bundled():
    return simulate()


@pytest.fixture(scope="module")
def busy():
    return simulate(BUSY)


def test_bundled_record_shows_what_the_paper_states(bundled):
    # Filip, Bazant, Mocek 2010, section 3: HPL "usually in the range from 10 to 12 m", "several
    # times above 15 m", HPE "doesn't exceed values of 2 m or 3 meters".
    hpl = bundled.table["hpl_m"].to_numpy()
    assert np.mean((hpl >= 10) & (hpl <= 12)) > 0.6
    assert 10 < np.median(hpl) < 12
    assert 1e-4 < np.mean(hpl > 15) < 0.02
    east, north, _ = errors_m(bundled, bundled_settings())
    hpe = np.hypot(east, north)
    assert np.quantile(hpe, 0.9999) < 3
    assert hpe.max() < 3
    # Section 4: HERL "usually larger" than HPL and "strongly depends on HDOP".
    herl = bundled.table["herl_m"].to_numpy()
    assert np.mean(herl > hpl) > 0.9
    assert bundled.table["herl_m"].corr(bundled.table["hdop"], method="spearman") > 0.5


def test_bundled_record_keeps_its_books(bundled):
    assert 299_000 < len(bundled) < 300_000
    assert len(bundled) == 300_000 - int(kinds(bundled, "gap")["duration_s"].sum())
    assert bundled.time[0] == np.datetime64("2009-09-19T00:00:00")
    assert bundled.time[-1] == np.datetime64("2009-09-22T11:19:59")
    assert len(bundled.side_tables["sbas_frames"]) == len(bundled)
    assert bundled.table["n_sv"].between(4, 12).all()
    meta = bundled.meta
    assert (meta.time_scale, meta.leap_seconds, meta.frame) == ("GPST", 15, "WGS 84/ITRF")
    assert (meta.pl.kind, meta.pl.k_h, meta.pl.k_v) == ("do229", 6.18, 5.33)
    assert meta.sources[0].format == "laboratory"
    assert meta.sources[0].path == "laboratory_2009"
    assert meta.options["seed"] == "20090919"
    assert RecordingMeta.from_json(meta.to_json()) == meta


@pytest.mark.parametrize("piece_epochs", [997, 4096, 5000, 10_799, 10_800, 50_000])
def test_pieces_have_the_same_digits_as_the_whole(busy, piece_epochs):
    pieces = list(simulate_pieces(BUSY, piece_epochs=piece_epochs))
    assert len(pieces) == -(-10_800 // piece_epochs)
    pd.testing.assert_frame_equal(
        pd.concat([p.table for p in pieces]), busy.table, check_exact=True, check_freq=False
    )
    for name, side in busy.side_tables.items():
        joined = pd.concat([p.side_tables[name] for p in pieces], ignore_index=True)
        pd.testing.assert_frame_equal(joined, side, check_exact=True)
    assert all(p.meta == busy.meta for p in pieces)


def test_a_longer_record_begins_with_the_shorter_one(busy):
    longer = simulate(BUSY, hours=4.5)
    pd.testing.assert_frame_equal(
        longer.table.iloc[: len(busy)], busy.table, check_exact=True, check_freq=False
    )


def test_the_seed_decides_the_digits(busy):
    again = simulate(BUSY)
    pd.testing.assert_frame_equal(again.table, busy.table, check_exact=True)
    other = simulate(BUSY, seed=6)
    assert other.meta.options["seed"] == "6"
    assert other.meta.sources[0].sha256 != busy.meta.sources[0].sha256
    common = other.table.index.intersection(busy.table.index)
    assert (other.table.loc[common, "lat_deg"] != busy.table.loc[common, "lat_deg"]).all()


def test_geometry_of_one_epoch_against_a_direct_inverse(bundled):
    s = bundled_settings()
    disturbed = bundled.side_tables["injected"]
    time = np.datetime64("2009-09-20T12:00:00", "ns")
    assert not ((disturbed["time"] - pd.Timestamp(time)).abs() < pd.Timedelta("10min")).any()
    row = bundled.table.loc[time]
    harmonics = slot_harmonics(SLOTS_27, lat_deg=50.03, lon_deg=15.77, height_m=289.4)
    enu = satellite_enu_m(harmonics, np.array([time]))[:, :, 0]
    unit = (enu / np.linalg.norm(enu, axis=0)).T
    elevation = np.arcsin(unit[:, 2])
    seen = elevation >= np.radians(5)
    g, el = np.column_stack([unit, np.ones(27)])[seen], elevation[seen]
    assert row["n_sv"] == seen.sum()
    dop = np.linalg.inv(g.T @ g)
    assert row["hdop"] == pytest.approx(np.sqrt(dop[0, 0] + dop[1, 1]))
    assert row["vdop"] == pytest.approx(np.sqrt(dop[2, 2]))
    assert row["pdop"] == pytest.approx(np.sqrt(np.trace(dop[:3, :3])))
    # UDREI 7 and 11, GIVEI 4 and 8, written out from DO-229's tables and formulas.
    flt = np.sqrt(1.8709) + (np.sqrt(20.7870) - np.sqrt(1.8709)) * np.exp(-np.degrees(el) / 12)
    hour = 12 + s.lon_deg / 15
    uive2 = 0.2079 + (0.6735 - 0.2079) * (1 + np.cos(2 * np.pi * (hour - 14) / 24)) / 2
    uire2 = uive2 / (1 - (6378.1363 * np.cos(el) / 6728.1363) ** 2)
    tropo2 = (0.12 * 1.001) ** 2 / (0.002001 + np.sin(el) ** 2)
    air2 = 0.36**2 + (0.13 + 0.53 * np.exp(-np.degrees(el) / 10)) ** 2
    d = np.linalg.inv(g.T @ np.diag(1 / (flt**2 + uire2 + tropo2 + air2)) @ g)
    assert row[["sigma_e_m", "sigma_n_m", "sigma_u_m"]].to_list() == pytest.approx(
        np.sqrt(np.diag(d)[:3])
    )
    assert row["cov_en_m2"] == pytest.approx(d[0, 1])
    assert row["hpl_m"] == pytest.approx(6.18 * np.sqrt(np.linalg.eigvalsh(d[:2, :2])[1]))
    assert row["vpl_m"] == pytest.approx(5.33 * np.sqrt(d[2, 2]))


def test_errors_are_gauss_markov_with_the_stated_covariance():
    # 60 h at tau = 20 s: 10 800 correlation times. Whitened by the stated covariance the errors
    # have variance 1 (sampling error of a variance: sqrt(2 tau / T)) and correlation exp(-1/20)
    # at one second (sampling error sqrt((1 - rho^2) / n)).
    s = LaboratorySettings(hours=60.0, decorrelation_time_s=20.0, error_scale=0.5, seed=8)
    recording = simulate(s)
    east, north, up = errors_m(recording, s)
    t = recording.table
    n, rho = len(t), np.exp(-1 / 20)
    assert n == s.epochs
    cov = np.empty((n, 2, 2))
    cov[:, 0, 0], cov[:, 1, 1] = t["sigma_e_m"] ** 2, t["sigma_n_m"] ** 2
    cov[:, 0, 1] = cov[:, 1, 0] = t["cov_en_m2"]
    whitened = np.linalg.solve(
        np.linalg.cholesky(cov), np.stack([east, north], axis=1)[:, :, None]
    )[:, :, 0].T
    whitened = np.vstack([whitened, up / t["sigma_u_m"].to_numpy()])
    for z in whitened:
        assert np.mean((z / 0.5) ** 2) == pytest.approx(1, abs=4 * np.sqrt(2 * 20 / n))
    for z in whitened[:2]:
        correlation = np.mean(z[1:] * z[:-1]) / np.mean(z**2)
        assert correlation == pytest.approx(rho, abs=4 * np.sqrt((1 - rho**2) / n))
    # East and north are independent once whitened.
    cross = np.mean(whitened[0] * whitened[1]) / 0.25
    assert abs(cross) < 4 * np.sqrt(20 / n)


def test_white_share_is_lost_at_the_first_lag():
    s = LaboratorySettings(hours=40.0, decorrelation_time_s=60.0, white_share=0.25, seed=2)
    recording = simulate(s)
    z = errors_m(recording, s)[0] / recording.table["sigma_e_m"].to_numpy()
    expected = 0.75 * np.exp(-1 / 60)
    got = np.mean(z[1:] * z[:-1]) / np.mean(z**2)
    # The correlation of the sum varies with the slow part's sampled variance.
    assert got == pytest.approx(expected, abs=4 * 0.25 * np.sqrt(2 * 60 / len(z)))


def test_failures_push_the_error_beyond_their_size_and_leave_the_protection_level():
    s = LaboratorySettings(
        hours=48.0, failure_rate_per_h=0.5, failure_duration_s=(10.0, 60.0),
        failure_error_m=(40.0, 90.0), seed=3, sbas_frames=False,
    )  # fmt: skip
    recording, quiet = simulate(s), simulate(replace(s, failure_rate_per_h=0.0))
    failures = kinds(recording, "failure")
    # Poisson, mean 24.
    assert abs(len(failures) - 24) < 4 * np.sqrt(24)
    east, north, _ = errors_m(recording, s)
    hpe = np.hypot(east, north)
    failed = np.zeros(len(recording), bool)
    for event in failures.itertuples():
        here = epochs_of(recording, event)
        assert here.sum() == event.duration_s
        assert (hpe[here] >= event.size_m).all()
        assert 40 <= event.size_m <= 90
        failed |= here
    assert hpe[~failed].max() < 5
    unmoved = [c for c in quiet.columns if c not in ("lat_deg", "lon_deg", "height_m")]
    pd.testing.assert_frame_equal(recording.table[unmoved], quiet.table[unmoved])
    assert (recording.table["hpl_m"][failed] < 20).all()


def test_failure_counts_over_many_records_are_poisson():
    s = LaboratorySettings(hours=20.0, interval_s=60.0, failure_rate_per_h=0.2, sbas_frames=False)
    counts = [len(kinds(simulate(s, seed=seed), "failure")) for seed in range(60)]
    assert np.mean(counts) == pytest.approx(4, abs=4 * np.sqrt(4 / 60))


def test_outliers_raise_hpl_to_their_size_and_vpl_in_proportion():
    s = LaboratorySettings(hours=24.0, hpl_outliers_per_day=20.0, sbas_frames=False, seed=1)
    recording, quiet = simulate(s), simulate(replace(s, hpl_outliers_per_day=0.0))
    outliers = kinds(recording, "hpl_outlier")
    assert 5 < len(outliers) < 40
    hpl, plain = recording.table["hpl_m"].to_numpy(), quiet.table["hpl_m"].to_numpy()
    raised = np.zeros(len(hpl), bool)
    for event in outliers.itertuples():
        here = epochs_of(recording, event)
        assert hpl[here] == pytest.approx(event.size_m)
        assert 60 <= event.size_m <= 100
        assert 2 <= event.duration_s <= 40
        raised |= here
    assert (hpl[~raised] == plain[~raised]).all()
    ratio = (recording.table["vpl_m"] / quiet.table["vpl_m"]).to_numpy()
    assert ratio == pytest.approx(hpl / plain)


def test_gaps_are_missing_epochs_and_frames_with_a_flag_behind(busy):
    gaps = kinds(busy, "gap")
    assert len(gaps) > 3
    for event in gaps.itertuples():
        assert not epochs_of(busy, event).any()
    frames = busy.side_tables["sbas_frames"]
    assert (frames["time"].to_numpy() == busy.time).all()
    after = (busy.table["flags"].to_numpy() & Flag.AFTER_GAP) != 0
    jump = np.diff(busy.time, prepend=busy.time[0]) > np.timedelta64(1, "s")
    assert jump.any()
    assert (after[1:] == jump[1:]).all()


def test_losses_take_satellites_and_widen_the_protection_level():
    s = LaboratorySettings(
        hours=24.0, satellite_losses_per_day=40.0, satellite_loss_share=0.5, seed=4
    )
    recording = simulate(s)
    quiet = simulate(replace(s, satellite_losses_per_day=0.0)).table
    lost = np.zeros(len(recording), bool)
    for event in kinds(recording, "satellite_loss").itertuples():
        lost |= epochs_of(recording, event)
    t = recording.table
    assert (t["n_sv"][lost] <= quiet["n_sv"][lost]).all()
    assert (t["n_sv"][~lost] == quiet["n_sv"][~lost]).all()
    fix = t["hpl_m"].notna()
    assert (t["hpl_m"][fix & lost] >= quiet["hpl_m"][fix & lost] * (1 - 1e-9)).all()
    # Fewer than four satellites: no fix and nothing that looks like one.
    without = t[t["n_sv"] < 4]
    assert len(without) > 0
    assert (without["mode"] == "none").all()
    assert (without["geo_prn"] == -1).all()
    numbers = [c for c in t.columns if COLUMNS[c].dtype == "f8"]
    assert without[numbers].isna().all().all()
    assert (t["n_sv"][fix] >= 4).all()
    assert (t["mode"][fix] == "sbas_npa").all()
    # RAIM needs five satellites.
    raim = (t["flags"].to_numpy() & Flag.RAIM_PASSED) != 0
    assert (raim == t["herl_m"].notna()).all()
    assert not raim[t["n_sv"] < 5].any()
    unavailable = (t["flags"].to_numpy() & Flag.RAIM_NOT_AVAILABLE) != 0
    assert (unavailable != raim).all()


def test_mode_sets_the_k_factor():
    npa = simulate(LaboratorySettings(hours=0.5))
    pa = simulate(LaboratorySettings(hours=0.5, mode="pa"))
    assert (pa.table["hpl_m"] / npa.table["hpl_m"]).to_numpy() == pytest.approx(6.0 / 6.18)
    assert (pa.table["mode"] == "sbas_pa").all()
    t = npa.table
    d_major = major_semi_axis_m(*(t[c].to_numpy() for c in ("sigma_e_m", "sigma_n_m", "cov_en_m2")))
    assert t["hpl_m"].to_numpy() == pytest.approx(6.18 * d_major)


@pytest.mark.parametrize("interval_s", [0.1, 0.3, 60.0])
def test_one_null_message_a_second_whatever_the_step(interval_s):
    recording = simulate(LaboratorySettings(hours=0.1, interval_s=interval_s))
    frames = recording.side_tables["sbas_frames"]
    assert len(frames) == 360
    assert (np.diff(frames["time"].to_numpy()) == np.timedelta64(1, "s")).all()
    assert len(recording) == round(360 / interval_s)
    without = simulate(LaboratorySettings(hours=0.1, sbas_frames=False))
    assert set(without.side_tables) == {"injected"}


def test_progress_ends_at_the_number_of_epochs():
    calls = []
    list(
        simulate_pieces(BUSY, piece_epochs=4000, progress=lambda done, of: calls.append((done, of)))
    )
    assert calls == [(4000, 10_800), (8000, 10_800), (10_800, 10_800)]


def test_impossible_requests_are_refused():
    with pytest.raises(ModelError):
        simulate(hours=0.0)
    with pytest.raises(ModelError):
        simulate(seed=-1)
    with pytest.raises(InputError):
        list(simulate_pieces(BUSY, piece_epochs=0))
