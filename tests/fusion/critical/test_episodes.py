"""Episodes against cases by hand and a plain walk through every run."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.fusion.critical.episodes import (
    Episodes,
    Target,
    combination_keys,
    extract_episodes,
    states_of_key,
)
from sbas.fusion.states import LETTERS, combination_name


def states(*rows: str) -> np.ndarray:
    """(rows, t, 1) codes, a row a sensor, or the output."""
    return np.array([[LETTERS[c] for c in row] for row in rows], np.int8)[:, :, np.newaxis]


def cut(sensors: tuple[str, ...], output: str, **options: object) -> Episodes:
    return extract_episodes(states(*sensors), states(output)[0], step_s=0.5, **options)  # type: ignore[arg-type]


def rows(found: Episodes) -> list[tuple[str, int, int, int, int]]:
    names = [combination_name(states_of_key(k, found.sensors)) for k in found.key.tolist()]
    return list(
        zip(
            names, found.entry_epoch.tolist(), found.length.tolist(), found.outcome.tolist(),
            found.steps.tolist(), strict=True,
        )
    )  # fmt: skip


def test_the_three_endings_by_hand() -> None:
    found = cut(("NUUUUNNNN", "NNNNNNUUU"), "NDDUDDUDN")
    assert rows(found) == [
        ("NN", 0, 1, 2, 1),
        ("UN", 1, 4, 1, 2),  # U at epoch 3, two steps after the entry
        ("NN", 5, 1, 2, 1),
        ("NU", 6, 3, -1, 0),  # U on entry: not at risk
    ]
    np.testing.assert_array_equal(found.there_at_entry, [False, False, False, True])
    np.testing.assert_array_equal(found.steps, [1, 2, 1, 0])
    assert found.step_s == 0.5
    # N, DA, U and silent epochs of each
    np.testing.assert_array_equal(
        found.output_epochs.T, [[1, 0, 0, 0], [0, 3, 1, 0], [0, 1, 0, 0], [1, 1, 1, 0]]
    )


def test_the_record_ends_after_the_last_epoch_seen() -> None:
    assert rows(cut(("NDDD",), "NNNN"))[-1] == ("D", 1, 3, 0, 2)
    assert rows(cut(("NNND",), "NNNN"))[-1] == ("D", 3, 1, 0, 0)


def test_an_event_at_the_first_epoch_of_the_next_stretch_is_not_this_ones() -> None:
    assert rows(cut(("NND",), "NNU")) == [("N", 0, 2, 2, 2), ("D", 2, 1, -1, 0)]


def test_silence_begins_another_combination() -> None:
    assert rows(cut(("DD--DD",), "NNNNNU")) == [
        ("D", 0, 2, 2, 2),
        ("-", 2, 2, 2, 2),
        ("D", 4, 2, 1, 1),
    ]


def test_a_silent_output_ends_the_stretch_and_is_not_at_risk() -> None:
    found = cut(("DDDDDD",), "N--DDU")
    assert rows(found) == [("D", 0, 1, 2, 1), ("D", 1, 2, -1, 0), ("D", 3, 3, 1, 2)]
    np.testing.assert_array_equal(found.counted, [True, False, True])
    np.testing.assert_array_equal(found.output_epochs[3], [0, 2, 0])


def test_an_entry_that_was_not_seen_counts_in_the_epochs_alone() -> None:
    found = cut(("DDDNNN",), "NNUNNN", starts_fresh=False)
    assert rows(found) == [("D", 0, 3, -1, 0), ("N", 3, 3, 0, 2)]
    assert found.output_epochs[:, 0].tolist() == [2, 0, 1, 0]
    assert found.counted.tolist() == [False, True]


def test_degraded_as_target() -> None:
    found = cut(("DDDUUUU",), "NNDDDNU", target="DA")
    assert rows(found) == [("D", 0, 3, 1, 2), ("U", 3, 4, -1, 0)]
    assert found.there_at_entry.tolist() == [False, True]


def walked(sensor: np.ndarray, output: np.ndarray, target: int) -> list[tuple[int, ...]]:
    """A plain loop over runs and epochs: (run, entry, length, outcome, steps)."""
    found = []
    n, t, r = sensor.shape
    for run in range(r):
        k = 0
        while k < t:
            end = k + 1
            while (
                end < t
                and all(sensor[i, end, run] == sensor[i, k, run] for i in range(n))
                and (output[end, run] == -1) == (output[k, run] == -1)
            ):
                end += 1
            if output[k, run] == -1 or output[k, run] >= target:
                found.append((run, k, end - k, -1, 0))
            else:
                hits = [j for j in range(k + 1, end) if output[j, run] >= target]
                if hits:
                    found.append((run, k, end - k, 1, hits[0] - k))
                elif end == t:
                    found.append((run, k, end - k, 0, end - 1 - k))
                else:
                    found.append((run, k, end - k, 2, end - k))
            k = end
    return found


@given(
    st.integers(1, 3), st.integers(1, 12), st.integers(1, 5), st.integers(0, 999),
    st.sampled_from(["U", "DA"]),
)  # fmt: skip
def test_equals_a_plain_walk(n: int, t: int, r: int, seed: int, target: Target) -> None:
    rng = np.random.default_rng(seed)
    sensor = rng.integers(-1, 3, (n, t, r)).astype(np.int8)
    # Long stretches: mostly as before.
    for k in range(1, t):
        stay = rng.random((r,)) < 0.7
        sensor[:, k, stay] = sensor[:, k - 1, stay]
    output = rng.choice(np.array([0, 0, 1, 2, -1], np.int8), (t, r))
    found = extract_episodes(sensor, output, step_s=1.0, target=target)
    expected = walked(sensor, output, {"U": 2, "DA": 1}[target])
    columns = (found.run, found.entry_epoch, found.length, found.outcome, found.steps)
    assert list(zip(*(c.tolist() for c in columns), strict=True)) == expected
    assert found.output_epochs.sum() == t * r
    for i, (run, k, *_) in enumerate(expected):
        assert states_of_key(int(found.key[i]), n) == tuple(sensor[:, k, run].tolist())
        assert found.entry_state[i] == output[k, run]


def test_keys_of_many_sensors_do_not_overflow() -> None:
    """All 31 sensors U: 4^31 - 1 (exact)."""
    keys = combination_keys(np.full((31, 1, 1), 2, np.int8))
    assert int(keys[0, 0]) == 4**31 - 1
    assert states_of_key(4**31 - 1, 31) == (2,) * 31
    for n in (3, 4, 7, 8, 15, 16):
        assert int(combination_keys(np.full((n, 1, 1), 2, np.int8))[0, 0]) == 4**n - 1
    with pytest.raises(InputError):
        combination_keys(np.zeros((32, 1, 1), np.int8))


@pytest.mark.parametrize(
    ("sensor", "output", "step_s", "target"),
    [
        (np.zeros((2, 3, 1), np.int8), np.zeros((3, 2), np.int8), 1.0, "U"),
        (np.zeros((2, 3), np.int8), np.zeros((3,), np.int8), 1.0, "U"),
        (np.zeros((2, 0, 1), np.int8), np.zeros((0, 1), np.int8), 1.0, "U"),
        (np.full((2, 3, 1), 3, np.int8), np.zeros((3, 1), np.int8), 1.0, "U"),
        (np.zeros((2, 3, 1), np.int8), np.full((3, 1), -2, np.int8), 1.0, "U"),
        (np.zeros((2, 3, 1)), np.zeros((3, 1), np.int8), 1.0, "U"),
        (np.zeros((2, 3, 1), np.int8), np.zeros((3, 1), np.int8), 0.0, "U"),
        (np.zeros((2, 3, 1), np.int8), np.zeros((3, 1), np.int8), np.nan, "U"),
        (np.zeros((2, 3, 1), np.int8), np.zeros((3, 1), np.int8), 1.0, "N"),
    ],
)
def test_wrong_input_is_refused(
    sensor: np.ndarray, output: np.ndarray, step_s: float, target: Target
) -> None:
    with pytest.raises(InputError):
        extract_episodes(sensor, output, step_s=step_s, target=target)
