from __future__ import annotations

from pathlib import Path

import numpy as np
import pymap3d
import pytest

from sbas.exceptions import InputError
from sbas.positioning.orbits import LIGHT_MPS, choose_records, kepler_state, length
from sbas.positioning.unaugmented_ranges import GALILEO_GM_M3PS2
from sbas.positioning.unaugmented_recording import unaugmented
from sbas.rinex.ephemerides import KeplerEphemerides, Navigation
from sbas.rinex.navigation_file import read_navigation
from sbas.satellite_table import SIDE_TABLE

KAMAKURA = "data/msas_kamakura_2025046"
VEHICLE = "data/msas_vehicle_2008147"
MIXED = "data/rinex/ELKO00USA_R_20182100000_01D_MN.rnx.gz"
PLACE = (40.0, -110.0, 1500.0)
EPOCHS = 5
OFFSET_M = {"G": 3000.0, "E": 3180.0}
"""Receiver clock as each constellation sees it."""


def test_noise_free_ranges_at_a_known_place(reference_data: Path) -> None:
    folder = reference_data / KAMAKURA
    recording = unaugmented(
        folder / "kamakura_synthetic_ranges.obs.gz", folder / "gps_lnav_12-15h_rinex3.nav"
    )
    table = recording.table.dropna(subset=["lat_deg"])
    assert len(table) > 10_600
    truth = pymap3d.ecef2geodetic(-3962069.5578, 3381374.5698, 3668677.1522)
    east, north, up = pymap3d.geodetic2enu(
        *(table[n].to_numpy() for n in ("lat_deg", "lon_deg", "height_m")), *truth
    )
    # What is left is MSAS's own corrections, which these ranges contain, and the ionosphere.
    assert np.hypot(east, north).max() < 3
    assert np.abs(up).max() < 8
    assert (table["mode"] == "standalone").all()
    assert "hpl_m" not in table
    assert "E25" in {f.code for f in recording.meta.findings}


def test_a_real_receiver_stays_where_it_is(reference_data: Path) -> None:
    folder = reference_data / VEHICLE
    table = unaugmented(
        folder / "ubx_20080526.obs", [folder / "ubx_20080526.nav", folder / "all.nav"]
    ).table.dropna(subset=["lat_deg"])
    assert len(table) > 230
    middle = table[["lat_deg", "lon_deg", "height_m"]].median()
    east, north, _up = pymap3d.geodetic2enu(
        *(table[n].to_numpy() for n in ("lat_deg", "lon_deg", "height_m")), *middle
    )
    assert np.hypot(east, north).max() < 10
    assert np.hypot(np.median(east), np.median(north)) < 1
    header = (-3869309.8278, 3436565.4776, 3717365.8937)
    assert np.linalg.norm(np.array(pymap3d.geodetic2ecef(*middle)) - header) < 15
    assert (table["sigma_u_m"] > table["sigma_e_m"]).all()


def galileo_as_gps(orbits: KeplerEphemerides) -> KeplerEphemerides:
    """F/NAV records whose mean motion is Galileo's, by the elements themselves."""
    keep = (orbits.source & 2) != 0
    values = {name: array[keep].copy() for name, array in vars(orbits).items()}
    motion = np.sqrt(GALILEO_GM_M3PS2 / values["sqrt_a"] ** 6) + values["delta_n"]
    values["delta_n"] = motion - np.sqrt(3.986005e14 / values["sqrt_a"] ** 6)
    return KeplerEphemerides(**values)


def written(path: Path, nav: Navigation) -> Path:
    """Ranges without atmosphere at PLACE, noon of 2018-07-29, with a clock per constellation."""
    place = np.array(pymap3d.geodetic2ecef(*PLACE))
    week_s = 2012 * 604_800
    lines = [
        f"{'     3.03           OBSERVATION DATA    M':60}RINEX VERSION / TYPE",
        f"{'G    1 C1C':60}SYS / # / OBS TYPES",
        f"{'E    1 C1X':60}SYS / # / OBS TYPES",
        f"{'  2018     7    29    12     0    0.0000000     GPS':60}TIME OF FIRST OBS",
        f"{'':60}END OF HEADER",
    ]
    for k in range(EPOCHS):
        received = 43_200.0 + 30 * k
        rows = []
        for system, orbits in (("G", nav.gps), ("E", galileo_as_gps(nav.galileo))):
            orbits = orbits.counted_from(week_s)
            for prn in np.unique(orbits.prn).tolist():
                record = choose_records(orbits, prn, np.array([received]))
                if record[0] < 0 or orbits.health[record[0]] & (7 if system == "E" else -1):
                    continue
                flight = 0.07
                for _ in range(8):
                    state = kepler_state(orbits, record, np.array([received - flight]))
                    angle = 7.2921151467e-5 * flight
                    x, y, z = state.position_m[0]
                    seen = np.array(
                        [
                            x * np.cos(angle) + y * np.sin(angle),
                            y * np.cos(angle) - x * np.sin(angle),
                            z,
                        ]
                    )
                    flight = float(length((seen - place)[None])[0]) / LIGHT_MPS
                east, north, up = pymap3d.ecef2enu(*seen, *PLACE)
                if np.degrees(np.arctan2(up, np.hypot(east, north))) < 10:
                    continue
                clock = (state.clock_s + state.relativity_s - state.tgd_s)[0] * LIGHT_MPS
                rows.append(
                    f"{system}{prn:02d}{flight * LIGHT_MPS - clock + OFFSET_M[system]:14.3f}"
                )
        lines += [
            f"> 2018 07 29 12 {k // 2:02d} {30 * (k % 2):2d}.0000000  0 {len(rows):2d}",
            *rows,
        ]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def test_two_constellations_have_a_clock_each(reference_data: Path, tmp_path: Path) -> None:
    nav = read_navigation(reference_data / MIXED)
    obs = written(tmp_path / "mixed.obs", nav)
    fixes = {s: unaugmented(obs, reference_data / MIXED, systems=s) for s in ("G", "E", "GE")}  # type: ignore[arg-type]
    both = fixes["GE"].side_tables[SIDE_TABLE]
    used = both[both["used"]]
    letters = used["satellite"].astype(str).str[0]
    assert (letters == "E").sum() >= 4
    assert (letters == "G").sum() >= 6
    # The weighted residuals of each constellation are balanced by its own clock.
    for letter in "GE":
        own = used[letters == letter]
        balance = (own["residual_m"] / own["sigma_m"] ** 2).groupby(own["time"]).sum()
        assert balance.abs().max() < 1e-6
    table = fixes["GE"].table.dropna(subset=["lat_deg"])
    assert len(table) >= 3
    # 180 m between the clocks, and no atmosphere in the ranges: a common clock would be far off.
    place = pymap3d.geodetic2enu(
        *(table[n].to_numpy() for n in ("lat_deg", "lon_deg", "height_m")), *PLACE
    )
    alone = fixes["G"].table.loc[table.index]
    gps = pymap3d.geodetic2enu(
        *(alone[n].to_numpy() for n in ("lat_deg", "lon_deg", "height_m")), *PLACE
    )
    assert np.hypot(*place[:2]).max() < 5
    assert np.hypot(place[0] - gps[0], place[1] - gps[1]).max() < 5
    assert (table["sigma_u_m"] < alone["sigma_u_m"]).all()
    assert (table["hdop"] < alone["hdop"]).all()


def test_files_without_the_systems_asked_for_are_refused(reference_data: Path) -> None:
    folder = reference_data / KAMAKURA
    files = folder / "kamakura_synthetic_ranges.obs.gz", folder / "gps_lnav_12-15h_rinex3.nav"
    with pytest.raises(InputError, match="Galileo"):
        unaugmented(*files, systems="GE")
    with pytest.raises(InputError, match="systems"):
        unaugmented(*files, systems="R")  # type: ignore[arg-type]
