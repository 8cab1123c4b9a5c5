"""Models of every format, and what takes the place of parts of them: mission, receiver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from sbas.dependability.exchange.galileo import TimeUnit, read_galileo
from sbas.dependability.exchange.losses import LossReport
from sbas.dependability.exchange.open_psa import read_open_psa, read_open_psa_model
from sbas.dependability.receiver.sojourns import EntryLaw, markov_source, semi_markov_source
from sbas.dependability.receiver.state_estimation import ReceiverStates
from sbas.dependability.receiver.state_tally import STATES
from sbas.dependability.static.static_tree import StaticTree
from sbas.dependability.tree.model import HybridFaultTree, MarkovSource
from sbas.dependability.tree.model_files import read_model_file
from sbas.exceptions import InputError, ModelError
from sbas.findings import Finding

SUFFIXES = {".xml": "Open-PSA", ".opsa": "Open-PSA", ".dft": "Galileo"}
"""Foreign formats by suffix; all else is a model file (TOML, JSON) or a bundled name."""


@dataclass(frozen=True)
class LoadedModels:
    """What a file holds.

    Parameters
    ----------
    models : by environment; a file without environments has one, by its name.
    static : instead of models, where the file gives probabilities and no rates.
    findings : of the file and of the check.
    losses : of a foreign format, what was not taken over; None for own files.
    """

    models: Mapping[str, HybridFaultTree]
    static: StaticTree | None = None
    findings: tuple[Finding, ...] = ()
    losses: LossReport | None = None


def load_any(
    path: str | Path,
    *,
    environment: str | None = None,
    parameters: Mapping[str, float] | None = None,
    override_rules: bool = False,
    step_s: float | None = None,
    mission_s: float | None = None,
    time_unit: TimeUnit | None = None,
    top: str | None = None,
) -> LoadedModels:
    """Models from a TOML, JSON, Open-PSA or Galileo file, or from a bundled name.

    Parameters
    ----------
    path : of the file, or a bundled name such as "galoroi".
    environment : the one to take; None is all.
    parameters, override_rules : of a model file, see `load_model`.
    step_s, mission_s : take the place of the file's [s]; a Galileo file has none.
    time_unit : of the rates of a Galileo file.
    top : of an Open-PSA file with several top gates.

    Returns
    -------
    LoadedModels. An Open-PSA file with rates becomes a hybrid tree, one that holds only
    probabilities, or what a hybrid tree cannot, a static tree.

    Raises
    ------
    InputError, ModelError : the file cannot be read, or means nothing.
    """
    kind = SUFFIXES.get(Path(path).suffix.lower())
    if kind == "Open-PSA":
        return _open_psa(Path(path), step_s, mission_s, top)
    if kind == "Galileo":
        if time_unit is None or mission_s is None:
            raise InputError(
                "a Galileo file says neither its unit of time nor its mission",
                where=str(path),
                cure="--time-unit h --mission 1h, and --step 1s for gates with memory",
            )
        imported = read_galileo(
            Path(path), time_unit=time_unit, step_s=step_s or 1.0, mission_s=mission_s
        )
        return LoadedModels({imported.model.name: imported.model}, losses=imported.report)
    file = read_model_file(
        path,
        environments=None if environment is None else [environment],
        parameters=parameters,
        override_rules=override_rules,
    )
    changed = bool(parameters) or mission_s is not None
    models = {
        name: _retimed(model, step_s, mission_s, changed=changed)
        for name, model in file.models.items()
    }
    return LoadedModels(models, findings=file.findings)


def _retimed(
    model: HybridFaultTree, step_s: float | None, mission_s: float | None, *, changed: bool
) -> HybridFaultTree:
    """The model with another epoch or mission; what its notes say of its rows must stay true."""
    if step_s is not None and step_s != model.step_s and model.sources:
        raise InputError(
            "the rows of a source belong to its epoch: another step would change their meaning",
            where=f"sources.{model.sources[0].name}",
            evidence=f"step {step_s:g} s, the file's {model.step_s:g} s",
            cure="leave out the step, or write rows for the new epoch",
        )
    notes = model.notes
    if changed:
        notes = tuple(
            f"{note}; with the file's own parameters and mission, not with those given here"
            if "by construction" in note
            else note
            for note in notes
        )
    return replace(
        model,
        step_s=model.step_s if step_s is None else step_s,
        mission_s=model.mission_s if mission_s is None else mission_s,
        notes=notes,
    )


def _open_psa(
    path: Path, step_s: float | None, mission_s: float | None, top: str | None
) -> LoadedModels:
    tree = read_open_psa(path, mission_s=mission_s, top=top)
    if not any(loss.treatment == "flattened" for loss in tree.report.losses):
        # Probabilities alone: nothing in it moves.
        return LoadedModels({}, tree.tree, losses=tree.report)
    try:
        imported = read_open_psa_model(path, step_s=step_s, mission_s=mission_s, top=top)
    except ModelError:
        # Weibull laws and common-cause groups: only their value at the mission's end is static,
        # which the report of losses says.
        return LoadedModels({}, tree.tree, losses=tree.report)
    return LoadedModels({imported.model.name: imported.model}, losses=imported.report)


def with_receiver(
    model: HybridFaultTree,
    states: ReceiverStates,
    *,
    environment: str | None = None,
    semi_markov: bool = False,
    estimate: EntryLaw = "counts",
) -> HybridFaultTree:
    """The model with the receiver that a recording shows in place of its own.

    Parameters
    ----------
    model : with one source whose states are correct, wrong and missing.
    states : of a recording, its step that of the model.
    environment : label of the chain to take; None for all together.
    semi_markov : take the recording's own laws of how long each state lasts.
    estimate : of the first-order chain, see `markov_source`: "posterior" where a state was never
        seen.

    Returns
    -------
    The model with its source's guard, waits and names, the recording's chain, and a note.

    Raises
    ------
    InputError : no such source, another step, or a state that the recording never showed.
    """
    if len(model.sources) != 1 or set(model.sources[0].states) != set(STATES):
        raise InputError(
            "the model has no single source with the states of a receiver",
            evidence=", ".join(f"{s.name}: {'/'.join(s.states)}" for s in model.sources),
            cure=f"one [[sources]] with states {', '.join(STATES)}",
        )
    old = model.sources[0]
    if semi_markov and estimate != "counts":
        raise InputError("a semi-Markov receiver is estimated from counts alone")
    make = semi_markov_source if semi_markov else partial(markov_source, estimate=estimate)
    new: MarkovSource = make(
        states, old.name, step_s=model.step_s, guard=old.guard, down=old.down,
        waiting=old.waiting, first_fix_s=old.first_fix_s, environment=environment,
    )  # fmt: skip
    kept = tuple(note for note in model.notes if "calibrated" not in note)
    notes = [*kept, f"receiver {old.name}: {new.source}"]
    if states.rejected and not semi_markov:
        notes.append(f"receiver {old.name}: the recording shows {states.conclusion}")
    if semi_markov:
        notes.append(f"receiver {old.name}: {_longest_runs(states, environment)}")
    name = f"{model.name.partition(', ')[0]}, receiver of a recording"
    return replace(model, name=name, sources=(new,), notes=tuple(notes))


def _longest_runs(states: ReceiverStates, environment: str | None) -> str:
    """What a gate that counts longer runs than any that was seen can say, in words."""
    longest = [
        f"{name} {max((length for length, _ in (*runs.completed, *runs.censored)), default=0)}"
        for name, runs in zip(STATES, states.chain_of(environment).runs, strict=True)
    ]
    return (
        f"the longest runs seen last {', '.join(longest)} epochs: a gate that counts more is told "
        "nothing by this recording, and a probability of 0 there means not seen"
    )
