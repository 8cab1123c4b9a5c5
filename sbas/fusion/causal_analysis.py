"""Which sensor faults matter, and how fast: one question over an architecture of sensors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from sbas.dependability.tree.model import HybridFaultTree
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.fusion.architecture.architecture_check import check_architecture, refuse_unmodelled
from sbas.fusion.architecture.architecture_files import load_architecture
from sbas.fusion.architecture.model import Architecture, SatelliteReceiver, Unmodelled
from sbas.fusion.critical.critical_times import CriticalTimes, convexity_holds, critical_times
from sbas.fusion.critical.episodes import Target
from sbas.fusion.fused_runs import FusedRuns
from sbas.fusion.importance.importance_results import StateImportances
from sbas.fusion.importance.state_importance import importance_by_state
from sbas.fusion.logic.boolean_form import two_line_form
from sbas.fusion.logic.interval_rules import MAX_SENSORS
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.recorded.recorded_bootstrap import RecordedSource, block_bootstrapped, replayed
from sbas.fusion.recorded.recorded_errors import RecordedErrors, along_track_errors
from sbas.fusion.recorded.state_sources import combination_source
from sbas.fusion.recorded.tree_events import failed_or, hardware_probability, state_fault_tree
from sbas.fusion.simulation.simulated_runs import simulate_runs
from sbas.fusion.states import NO_DATA, StateShares, shares
from sbas.numerals import number, upward
from sbas.recording import Recording
from sbas.track import Track
from sbas.truth import Truth

Resampling = Literal["replay", "block_bootstrap"]
MOST_BYTES = 6_000_000_000
LEAST_RUNS = 2
"""Intervals draw whole runs again: a single one has none."""


@dataclass(frozen=True, eq=False, repr=False)
class CausalAnalysis:
    """Runs of an architecture, and what they say of its sensors' faults.

    Parameters
    ----------
    architecture : what was simulated.
    runs : states of sensors and output.
    seed : of runs and intervals.
    shares : availability, safety and hazard of the output.
    critical : combinations and their times.
    table : truth table of so many sensors, N where no sensor is U and one is N, U where all are.
    importance : of the sensors' levels, under three laws; None where no epoch has a state of
        every sensor.
    recorded : of the recording that stood for a receiver, None without one.
    resampled : how its errors were drawn.
    findings : of architecture, recording and figures.
    """

    architecture: Architecture
    runs: FusedRuns
    seed: int
    shares: StateShares
    critical: CriticalTimes
    table: TruthTable
    importance: StateImportances | None
    recorded: RecordedErrors | None
    resampled: RecordedSource | None
    findings: tuple[Finding, ...]

    @property
    def time_to_alert_s(self) -> float | None:
        """Shortest `reach_q05_s` of all combinations [s]: within it an alert must come.

        0 where one is in the target state at entry in 5 % of its episodes, critical or not: that
        it gets no worse later leaves no more time. None where no combination is seen to get there.
        Source: Railways 2014, section 4 (the critical time as a time to alarm).
        """
        known = [float(t) for t in self.critical.table["reach_q05_s"] if math.isfinite(t)]
        return min(known) if known else None

    @property
    def hardware(self) -> dict[str, float]:
        """Probability that the hardware of each sensor fails within a run [1]; never sampled."""
        return {
            sensor.name: float(
                hardware_probability(sensor.failure_rate_per_h, self.architecture.duration_s)
            )
            for sensor in self.architecture.sensors
            if not isinstance(sensor, Unmodelled)
        }

    @property
    def hazard_with_hardware(self) -> float:
        """Share of hazard, or a sensor's hardware failed by the end of a run: an upper bound [1].

        A fusion that tolerates the loss of a sensor loses less.
        """
        rates = sum(
            sensor.failure_rate_per_h
            for sensor in self.architecture.sensors
            if not isinstance(sensor, Unmodelled)
        )
        return float(failed_or(self.shares.hazard, rates, self.architecture.duration_s))

    def fault_tree(
        self,
        *,
        condition: Literal["isU", "notN"] | None = None,
        critical_at: Literal["reach_q05_s", "event_q05_s"] | None = "reach_q05_s",
    ) -> HybridFaultTree:
        """The states seen here as a fault tree for `sbas.depend`, over the time of one run.

        Parameters
        ----------
        condition : top event of the truth table; None: "isU", or "notN" where the critical times
            are those to DA.
        critical_at : column of the critical times at which a combination counts as lasting too
            long: "reach_q05_s" has those that are unacceptable at entry (with more than 5 % of
            them the gate is true at once), "event_q05_s" leaves them out; None: no such gates.

        Returns
        -------
        HybridFaultTree over one source of the sensors' joint states, whose rows change along the
        run as the sensors drift, with hardware failures, and a duration gate for each critical
        combination.

        Raises
        ------
        InputError : a condition that these runs never met.
        """
        condition = condition or ("isU" if self.critical.target == "U" else "notN")
        times = self.critical.table.loc[list(self.critical.critical), critical_at or "reach_q05_s"]
        step_s = self.architecture.step_s
        return state_fault_tree(
            self.table,
            combination_source(
                self.runs.sensor_state,
                step_s=step_s,
                provenance=f"{self.runs.runs:,} runs of {self.architecture.name}, seed {self.seed}",
            ),
            condition=condition,
            step_s=step_s,
            # The first epoch of a run, one step after its start, is epoch 0 of the tree.
            mission_s=self.architecture.duration_s - step_s,
            failure_rates_per_h={
                sensor.name: sensor.failure_rate_per_h
                for sensor in self.architecture.sensors
                if not isinstance(sensor, Unmodelled) and sensor.failure_rate_per_h > 0
            },
            critical={str(name): float(t) for name, t in times.items() if math.isfinite(t)}
            if critical_at is not None
            else None,
            name=f"{condition} of {self.architecture.name}",
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        plain = self.critical.to_dict()
        return {
            "architecture": self.architecture.name,
            **plain,
            "duration_s": self.architecture.duration_s,
            "seed": self.seed,
            "output": self.shares.to_dict(),
            "time_to_alert_s": self.time_to_alert_s,
            "weights": self.runs.weights.tolist() if self.runs.weights.size else None,
            "importance": None if self.importance is None else self.importance.to_dict(),
            "hardware_failure_in_a_run": self.hardware,
            "hazard_with_hardware": self.hazard_with_hardware,
            "recorded": None if self.recorded is None else self.recorded.to_dict(),
            "resampled": None if self.resampled is None else self.resampled.to_dict(),
            "findings": [finding.to_dict() for finding in self.findings],
        }

    def __repr__(self) -> str:
        out, found = self.shares, self.critical
        lines = [
            f"{self.architecture.name}: {self.runs.runs:,} runs of "
            f"{self.architecture.duration_s:g} s, step {self.runs.step_s:g} s, seed {self.seed}; "
            "modelled",
            *self._recorded_line(),
            "  output "
            + ", ".join(
                f"{word} {number(epochs / out.epochs, 4)}"
                for word, epochs in (
                    ("N", out.nominal),
                    ("DA", out.degraded),
                    ("U", out.unacceptable),
                    ("no data", out.no_data),
                )
            ),
            f"  available {number(out.available, 4)}, safe {number(out.safe, 4)}, "
            f"hazard {number(out.hazard, 4)}",
            *self._hardware_line(),
            f"  combinations of {', '.join(found.names)} (N, D for DA, U, - for no data): "
            f"{sum('-' not in name for name in found.table.index)} of {3 ** len(found.names)} met, "
            f"{sum('-' not in name for name in found.critical)} of them critical",
        ]
        for name in found.critical:
            row = found.table.loc[name]
            lines.append(
                f"    {name}: reaches {found.target} in {row['incidence']:.3f} "
                f"[{row['incidence_lower']:.3f}, {row['incidence_upper']:.3f}], median "
                f"{row['event_median_s']:.4g} s; {found.target} at entry "
                f"{row[f'p_{found.target.lower()}_at_entry']:.3f}"
            )
        lines += [str(finding) for finding in self.findings]
        return "\n".join(lines)

    def _hardware_line(self) -> Iterator[str]:
        if any(self.hardware.values()):
            yield (
                f"  hazard, or hardware of any sensor failed by the end of a run: at most "
                f"{upward(self.hazard_with_hardware, 4)}"
            )

    def _recorded_line(self) -> Iterator[str]:
        if self.recorded is None or self.resampled is None:
            return
        files = ", ".join(str(source.get("path", "")) for source in self.recorded.sources)
        yield (
            f"  receiver: errors along the track of {files or 'a recording'}, "
            f"{self.resampled.kind.replace('_', ' ')}; "
            f"U {number(self.resampled.recorded_u_share, 4)} recorded, "
            f"{number(self.resampled.drawn_u_share, 4)} drawn"
        )
        counts = self.recorded.counts
        yield (
            f"  its horizontal error by its level, of {counts.judged:,} epochs: hazard (HMI) "
            f"{counts.hazard:,}, detected {counts.detected:,}, safe or available "
            f"{counts.safe + counts.available:,}, false alarms "
            f"{counts.false_alarm_n + counts.false_alarm_da:,}, misleading without hazard "
            f"{counts.misleading:,}; levels take no part in the fusion"
        )


def multisensor(
    model: str | Path | Architecture,
    *,
    runs: int = 2000,
    seed: int = 0,
    recording: Recording | None = None,
    truth: Truth | None = None,
    track: Track | None = None,
    azimuth_deg: float | None = None,
    direction_above_mps: float | None = None,
    receiver: str | None = None,
    resampling: Resampling = "replay",
    target: Target = "U",
    replicates: int = 1000,
    accept_findings: Iterable[str] = (),
    progress: Callable[[int, int], None] | None = None,
) -> CausalAnalysis:
    """Which sensor faults spoil the position of an architecture, and how fast?

    Parameters
    ----------
    model : architecture, its TOML file, or the name of a preset such as "arch1".
    runs : number of runs simulated.
    seed : of runs and intervals.
    recording : of a GNSS receiver, whose signed errors take the place of its model.
    truth, track, azimuth_deg, direction_above_mps : of the recording, see `along_track_errors`.
    receiver : sensor that the recording stands for; None: the only satellite receiver.
    resampling : windows of the recording, or blocks of it.
    target : output state whose reaching is the event.
    replicates : of the bootstrap over runs.
    accept_findings : codes of errors in the recording to accept as warnings.
    progress : called with (runs done, runs in all).

    Returns
    -------
    CausalAnalysis. All of it is `modelled`: it says what the error models imply.

    Raises
    ------
    ModelError : a model that cannot be simulated, such as one with a sensor without error model.
    InputError : too few runs or too many for the memory, too many sensors, a recording whose
        errors have no sign, or what belongs to a recording without one.

    References
    ----------
    Railways 2014, sections 3.1 to 3.3.
    """
    architecture = model if isinstance(model, Architecture) else load_architecture(model)
    if runs < LEAST_RUNS:
        raise InputError("intervals need several runs", where="runs", evidence=f"{runs}",
                         cure=f"runs={LEAST_RUNS} or more, better thousands")  # fmt: skip
    if resampling not in get_args(Resampling):
        raise InputError("unknown resampling", where="resampling", evidence=repr(resampling),
                         cure=" or ".join(get_args(Resampling)))  # fmt: skip
    of_recording = {
        "truth": truth, "track": track, "azimuth_deg": azimuth_deg,
        "direction_above_mps": direction_above_mps, "receiver": receiver,
    }  # fmt: skip
    useless = [name for name, value in of_recording.items() if value is not None]
    if recording is None and useless:
        raise InputError(
            f"{', '.join(useless)} without a recording", cure="recording=sbas.read(FILE), or "
            "leave it out: all sensors are simulated then",
        )  # fmt: skip
    findings = list(check_architecture(architecture))
    _check_size(architecture, runs, replicates)
    recorded = resampled = None
    sources = {}
    if recording is not None:
        name = _receiver_of(architecture, receiver)
        recorded = along_track_errors(
            recording, truth=truth, track=track, azimuth_deg=azimuth_deg,
            direction_above_mps=direction_above_mps, thresholds=architecture.thresholds,
            accept_findings=accept_findings,
        )  # fmt: skip
        drawn_from = replayed if resampling == "replay" else block_bootstrapped
        resampled = drawn_from(
            recorded, step_s=architecture.step_s, duration_s=architecture.duration_s,
            axes=3 if architecture.axes == 3 else 1,
        )  # fmt: skip
        sources[name] = resampled
        findings += [*recorded.findings, *resampled.findings]
        if recorded.labels and resampling == "replay":
            findings.append(
                Finding(
                    "E28", "info", "environments do not part a replay: its windows cross them",
                    evidence=", ".join(recorded.labels),
                    cure='"block_bootstrap" keeps each run within one environment',
                )
            )  # fmt: skip
    refuse_unmodelled(architecture, supplied=sources)
    fused = simulate_runs(architecture, runs=runs, seed=seed, sources=sources, progress=progress)
    critical = critical_times(
        fused.sensor_state, fused.output_state, names=fused.names, step_s=fused.step_s,
        target=target, convex=convexity_holds(architecture), replicates=replicates, seed=seed,
        # A window of a recording begins inside whatever lasts there: that entry was not seen.
        starts_fresh=not sources,
    )  # fmt: skip
    table = two_line_form(fused.names)
    complete = (fused.sensor_state != NO_DATA).all(axis=0) & (fused.output_state != NO_DATA)
    importance = None
    if complete.any():
        importance = importance_by_state(table, fused, replicates=replicates, seed=seed)
    else:
        findings.append(_never_complete(fused))
    if sources and fused.weights.size and architecture.weights != "fixed":
        findings.append(_weights_of_recording(fused))
    findings += critical.findings
    return CausalAnalysis(
        architecture, fused, seed, shares(fused.output_state, fused.declared_usable), critical,
        table, importance, recorded, resampled, tuple(dict.fromkeys(findings)),
    )  # fmt: skip


def _check_size(architecture: Architecture, runs: int, replicates: int) -> None:
    """Refuse what a truth table or the memory has no room for, before anything is simulated."""
    n = len(architecture.sensors)
    if n > MAX_SENSORS:
        raise InputError(
            f"a truth table has at most {MAX_SENSORS} sensors", where=architecture.name,
            evidence=f"{n} sensors", cure="leave some out, or fuse groups on their own",
        )  # fmt: skip
    # States, errors and keys of the epochs, and the draws of runs for the intervals.
    bytes_a_run = architecture.epochs * (3 * n + 40) + 4 * (replicates + 1)
    if runs * bytes_a_run > MOST_BYTES:
        raise InputError(
            "so many runs do not fit into the memory", where="runs",
            evidence=f"{runs:,} runs take some {runs * bytes_a_run / 1e9:.0f} GB",
            cure=f"at most {MOST_BYTES // bytes_a_run:,} runs, or fewer replicates",
        )  # fmt: skip


def _never_complete(fused: FusedRuns) -> Finding:
    silent = [
        name for name, state in zip(fused.names, fused.sensor_state, strict=True)
        if (state == NO_DATA).all()
    ]  # fmt: skip
    return Finding(
        "E15", "warning", "no epoch has a state of every sensor: importance is not estimable",
        where=", ".join(silent), evidence=f"{fused.runs:,} runs of {fused.epochs:,} epochs",
        cure="leave the silent sensor out of the architecture",
    )  # fmt: skip


def _weights_of_recording(fused: FusedRuns) -> Finding:
    mean = fused.weights.reshape(-1, len(fused.names)).mean(axis=0)
    return Finding(
        "E28", "info",
        "the recorded receiver's variance, its faults included, sets the weights of the fusion",
        evidence=", ".join(f"{n} {w:.3f}" for n, w in zip(fused.names, mean, strict=True))
        + ("" if fused.weights.shape[:-1] == (1,) else " (means over axes and epochs)"),
        cure='weights = "fixed" keeps those of another design',
    )  # fmt: skip


def _receiver_of(architecture: Architecture, asked: str | None) -> str:
    """Name of the sensor that a recording stands for."""
    receivers = [s.name for s in architecture.sensors if isinstance(s, SatelliteReceiver)]
    if asked is None and len(receivers) == 1:
        return receivers[0]
    if asked is not None and asked in receivers:
        return asked
    raise InputError(
        "a recording stands for one satellite receiver",
        where=architecture.name,
        evidence=f"asked for {asked!r}, there are {', '.join(receivers) or 'none'}",
        cure=f"--receiver {receivers[0]}" if receivers else "a sensor of kind gnss",
    )
