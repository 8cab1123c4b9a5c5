"""Stanford-ESA against every subset solved one by one."""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
import pandas as pd
import pymap3d
import pytest

from sbas.exceptions import InputError
from sbas.positioning.normal_equations import design, enu_of
from sbas.positioning.satellite_subsets import stanford_esa, subset_members
from sbas.recording import ProtectionLevelMeta, Recording, RecordingMeta
from sbas.satellite_table import SIDE_TABLE, satellite_table
from sbas.truth import FixedPoint

TRUTH = FixedPoint(50.0, 15.0, 300.0, frame="ITRF2020")
START = np.datetime64("2026-03-01T10:00:00", "ns")


def recording(counts: list[int], seed: int = 1, *, noise_m: float = 2.0) -> Recording:
    """Epochs with so many satellites, noisy ranges and the weighted fix that they make."""
    rng = np.random.default_rng(seed)
    rows, fixes = [], []
    for n, m in enumerate(counts):
        time = START + np.timedelta64(n, "s")
        elevation, azimuth = rng.uniform(5, 90, m), rng.uniform(0, 360, m)
        sigma, error = rng.uniform(1, 4, m), rng.normal(0, noise_m, m)
        g = design(enu_of(elevation, azimuth))
        w = sigma**-2.0
        x = np.linalg.solve((g * w) @ g.T, (g * w) @ error) if m >= 4 else np.zeros(4)
        lat, lon, height = pymap3d.enu2geodetic(
            *(-x[:3]), TRUTH.lat_deg, TRUTH.lon_deg, TRUTH.height_m
        )
        fixes.append((time, lat, lon, height))
        rows += [
            (time, f"G{i + 1:02d}", elevation[i], azimuth[i], sigma[i], error[i] - g[:, i] @ x)
            for i in range(m)
        ]
    names = ("time", "satellite", "elevation_deg", "azimuth_deg", "sigma_m", "residual_m")
    columns = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    time = np.array(columns.pop("time"), "M8[ns]")
    side = satellite_table(
        time,
        {
            **{k: np.array(v) for k, v in columns.items() if k != "satellite"},
            "satellite": pd.Categorical(columns["satellite"]),
            "used": np.ones(len(rows), bool),
        },
    )
    table = pd.DataFrame(fixes, columns=["time", "lat_deg", "lon_deg", "height_m"])
    table = table.set_index(pd.DatetimeIndex(table.pop("time"), name="time").as_unit("ns"))
    meta = RecordingMeta(pl=ProtectionLevelMeta("do229", k_h=6.0, k_v=5.33))
    return Recording(table, meta, {SIDE_TABLE: side})


def one_by_one(source: Recording, k_h: float) -> list[tuple[int, str, float, float]]:
    """Epoch, satellites, error and level of every subset: one least-squares fit each."""
    found = []
    side = source.side_tables[SIDE_TABLE]
    for n, (time, fix) in enumerate(source.table.iterrows()):
        rows = side[side["time"] == time]
        east, north, _ = pymap3d.geodetic2enu(
            fix["lat_deg"], fix["lon_deg"], fix["height_m"],
            TRUTH.lat_deg, TRUTH.lon_deg, TRUTH.height_m,
        )  # fmt: skip
        e, a = (np.radians(rows[name].to_numpy()) for name in ("elevation_deg", "azimuth_deg"))
        g = np.column_stack([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e), 0 * e + 1])
        w, r = 1 / rows["sigma_m"].to_numpy(), rows["residual_m"].to_numpy()
        names = rows["satellite"].astype(str).to_numpy()
        for size in range(4, len(rows) + 1):
            for subset in combinations(range(len(rows)), size):
                at = list(subset)
                scaled = g[at] * w[at, None]
                x = np.linalg.lstsq(scaled, r[at] * w[at], rcond=None)[0]
                d = np.linalg.inv(scaled.T @ scaled)
                level = k_h * np.sqrt(np.linalg.eigvalsh(d[:2, :2])[-1])
                hpe = float(np.hypot(east - x[0], north - x[1]))
                found.append((n, " ".join(names[at]), hpe, float(level)))
    return found


def test_all_subsets_are_those_of_brute_force() -> None:
    source = recording([6, 8, 5, 7, 4])
    got = stanford_esa(source, TRUTH)
    exact = one_by_one(source, 6.0)
    assert (
        got.subsets
        == len(exact)
        == sum(sum(comb(m, k) for k in range(4, m + 1)) for m in (6, 8, 5, 7, 4))
    )
    assert (got.degenerate, got.epochs, got.left_out, got.lacking_at_most) == (0, 5, 0, None)
    assert got.misleading == sum(hpe >= level for _, _, hpe, level in exact)
    for n in range(5):
        ratio, hpe, level, names = max(
            (hpe / level, hpe, level, names) for at, names, hpe, level in exact if at == n
        )
        row = got.worst.iloc[n]
        assert row["satellites"] == names
        assert row["n_sv"] == len(names.split())
        assert [row["ratio"], row["hpe_m"], row["hpl_m"]] == pytest.approx(
            [ratio, hpe, level], rel=1e-6
        )
    cells = np.zeros_like(got.counts)
    last = len(cells) - 1
    for _, _, hpe, level in exact:
        up = np.flatnonzero(got.edges_m <= hpe)[-1]
        across = np.flatnonzero(got.edges_m < level)[-1]
        cells[min(up, last), min(across, last)] += 1
    assert (got.counts == cells).all()


def test_a_large_error_shows_in_its_subsets() -> None:
    """One satellite off by 60 m: some subset that holds it is misled, the others are not."""
    source = recording([8], seed=5, noise_m=0.3)
    side = source.side_tables[SIDE_TABLE]
    residual = side["residual_m"].to_numpy(copy=True)
    residual[2] += 60.0
    bad = source.replace(side_tables={SIDE_TABLE: side.assign(residual_m=residual)})
    sound, misled = stanford_esa(source, TRUTH), stanford_esa(bad, TRUTH)
    assert sound.misleading == 0
    assert misled.misleading > 0
    assert "G03" in misled.worst["satellites"].iloc[0].split()
    assert misled.worst["ratio"].iloc[0] > 1


def test_many_satellites_are_limited() -> None:
    members = subset_members(14)
    assert len(members) == sum(comb(14, k) for k in range(5))
    assert members[0].all()
    assert len(np.unique(members, axis=0)) == len(members)
    assert len(subset_members(12)) == sum(comb(12, k) for k in range(4, 13))
    assert subset_members(4).tolist() == [[True] * 4]
    assert stanford_esa(recording([13]), TRUTH).lacking_at_most == 4


def test_levels_of_full_sets_are_those_of_the_recording() -> None:
    from sbas.positioning.satellite_levels import levels_from_satellites

    source = recording([4, 4, 4])
    got = stanford_esa(source, TRUTH)
    levels = levels_from_satellites(source, k_h=6.0, k_v=5.33).table["hpl_m"].to_numpy()
    assert got.worst["hpl_m"].to_numpy() == pytest.approx(levels)


def test_ties_count_on_the_unsafe_side() -> None:
    from sbas.positioning.satellite_subsets import _cell

    up, across = _cell(np.array([0.0, 1.0, 9.0, 70.0]), np.array([1.0, 2.0, 9.5, 80.0]), 1.0, 10)
    assert up.tolist() == [0, 1, 9, 9]
    assert across.tolist() == [0, 1, 9, 9]


def test_degenerate_subsets_have_no_fix() -> None:
    source = recording([6])
    side = source.side_tables[SIDE_TABLE]
    azimuth = side["azimuth_deg"].to_numpy(copy=True)
    elevation = side["elevation_deg"].to_numpy(copy=True)
    azimuth[:3], elevation[:3] = 100.0, 30.0
    flat = source.replace(
        side_tables={SIDE_TABLE: side.assign(azimuth_deg=azimuth, elevation_deg=elevation)}
    )
    got = stanford_esa(flat, TRUTH)
    # Of the first three only one counts: a subset needs all of the others, and one of them.
    solvable = sum(1 for k in range(4, 7) for s in combinations(range(6), k) if {3, 4, 5} <= set(s))
    assert got.subsets - got.degenerate == solvable
    assert got.counts.sum() == solvable


def test_epochs_that_cannot_be_judged_are_left_out() -> None:
    source = recording([5, 3, 6, 6, 6])
    side = source.side_tables[SIDE_TABLE]
    residual = side["residual_m"].to_numpy(copy=True)
    residual[-1] = np.nan
    table = source.table.copy()
    table.iloc[3, 0] = np.nan
    bad = source.replace(table=table, side_tables={SIDE_TABLE: side.assign(residual_m=residual)})
    got = stanford_esa(bad, TRUTH)
    assert (got.epochs, got.left_out) == (2, 3)
    assert got.worst.index.tolist() == [source.table.index[0], source.table.index[2]]


def test_one_batch_or_many(monkeypatch: pytest.MonkeyPatch) -> None:
    source = recording([7, 7, 7, 9])
    whole = stanford_esa(source, TRUTH)
    monkeypatch.setattr("sbas.positioning.satellite_subsets._BATCH", 1)
    parts = stanford_esa(source, TRUTH)
    assert (whole.counts == parts.counts).all()
    assert whole.worst["satellites"].tolist() == parts.worst["satellites"].tolist()


@pytest.mark.parametrize(
    "options", [{"k_h": 0.0}, {"k_h": np.nan}, {"cell_m": 0.0}, {"largest_m": 0.1}]
)
def test_options_that_make_no_sense(options: dict[str, float]) -> None:
    with pytest.raises(InputError):
        stanford_esa(recording([5]), TRUTH, **options)


def test_a_factor_is_needed() -> None:
    source = recording([5]).replace(meta=RecordingMeta())
    with pytest.raises(InputError, match="K factor"):
        stanford_esa(source, TRUTH)
