"""What the causal analysis found, as events and gates of a hybrid fault tree.

A sensor's basic event is "hardware failed, or state U"; DA and U exclude each other, being states
of one source. Hardware is added exactly, since no simulation of 100 s ever sees it fail.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.dependability.tree.durations import duration_epochs
from sbas.dependability.tree.model import (
    And,
    Component,
    Dur,
    Event,
    Failed,
    Gate,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
)
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import InputError
from sbas.fusion.logic.boolean_form import Condition, Implicant, holds, prime_implicants
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.states import DA, LETTERS, NO_DATA, WORDS, N, U, combination_codes

NOTES = (
    "the truth table stands for the fusion: a simulated fusion may be unacceptable more often",
    "a sensor without data counts as U: a truth table has no fourth state",
    "the gate of a critical combination holds in worse ones too, whatever its nominal sensors do",
)
"""What every tree of this module supposes; it travels with it."""


def hardware_probability(failure_rate_per_h: ArrayLike, seconds: ArrayLike) -> NDArray[np.float64]:
    """Probability that hardware has failed by some time, 1 - exp(-lambda t) [1].

    Parameters
    ----------
    failure_rate_per_h : lambda [1/h], 0 or more.
    seconds : t [s], 0 or more.

    Raises
    ------
    InputError : a rate or time below 0, or no number.

    References
    ----------
    Railways 2014, section 3.1 (exponential failures of hardware).

    Examples
    --------
    >>> f"{float(hardware_probability(1e-6, 100.0)):.3e}"
    '2.778e-08'
    """
    rate, time = np.asarray(failure_rate_per_h, float), np.asarray(seconds, float)
    if not (np.all(rate >= 0) and np.all(time >= 0)):
        raise InputError(
            "failure rates and times are 0 or more", evidence=f"{rate.min()} /h, {time.min()} s"
        )
    return np.asarray(-np.expm1(-rate * time / 3600.0))


def failed_or(
    share: ArrayLike, failure_rate_per_h: ArrayLike, seconds: ArrayLike
) -> NDArray[np.float64]:
    """Probability that hardware has failed by some time, or a state of this share holds [1].

    Parameters
    ----------
    share : of the state among the epochs of a simulation without failures, 0 to 1.
    failure_rate_per_h, seconds : as `hardware_probability`; failures do not depend on the state.

    Notes
    -----
    P = p + (1 - p) h: of the terms none is a difference that cancels.
    """
    p = np.asarray(share, float)
    if not np.all((p >= 0) & (p <= 1)):
        raise InputError("a share lies between 0 and 1", evidence=f"{p.min()} to {p.max()}")
    return np.asarray(p + (1.0 - p) * hardware_probability(failure_rate_per_h, seconds))


def state_fault_tree(
    table: TruthTable,
    sources: Mapping[str, MarkovSource] | MarkovSource,
    *,
    condition: Condition = "isU",
    step_s: float,
    mission_s: float,
    failure_rates_per_h: Mapping[str, float] | None = None,
    critical: Mapping[str, float] | None = None,
    name: str = "",
) -> HybridFaultTree:
    """The fault tree of an output that is not N, or is U, over the states of its sensors.

    Parameters
    ----------
    table : output in every combination of sensor states.
    sources : by sensor, of `sensor_source` or `recorded_source` (then independent of each other);
        or the joint one of `combination_source`, which keeps what the sensors share.
    condition : "isU" or "notN"; the gate of this name.
    step_s, mission_s : epoch, which is that of the sources' rows, and mission [s].
    failure_rates_per_h : of the hardware of sensors, by name [1/h]; not repaired.
    critical : by combination (a letter a sensor: N, D for DA, U, and "-" for no data), the time
        for which it may last [s]: a low quantile, not the mean, such as `reach_q05_s` of
        `critical_times`. It is rounded down to whole steps.
    name : of the model.

    Returns
    -------
    HybridFaultTree, its top the condition, or where there are critical combinations "TOP": the
    condition or any of them. The gate of a critical combination is true once all its faulty
    sensors have been in their states, or worse, for its time: a sensor that gets worse meanwhile
    ends nothing, which is the unsafe side.

    Raises
    ------
    InputError : sources or rates of other sensors, a condition that is always or never true, a
        combination without a fault, or a time that is not known.
    ModelError : a model that the dependability engine refuses, such as a mission that is no
        whole number of steps.

    References
    ----------
    Railways 2014, section 3.1, steps 4 and 5 (truth table, persistence).
    """
    rates = dict(failure_rates_per_h or {})
    _check_names(table, sources, rates)
    implicants = prime_implicants(table, condition)
    if not implicants or not implicants[0].literals:
        raise InputError(
            f"the condition {condition!r} is {'always' if implicants else 'never'} true in this "
            "table: there is nothing to analyse",
            evidence=table.provenance,
        )
    tree = _Tree(table.names, sources, rates)
    products = [
        tree.product(f"{condition} {i}", implicant) for i, implicant in enumerate(implicants, 1)
    ]
    never = isinstance(sources, MarkovSource) and not _ever(table, condition, sources)
    if never and not rates:
        raise InputError(
            f"the condition {condition!r} was never met: a probability of 0 would mean not seen",
            cure="more runs, or failure rates of the hardware",
        )  # fmt: skip
    tree.gates.append(Or(condition, tuple(products)))
    lasting = [
        tree.lasting(letters, seconds, step_s) for letters, seconds in (critical or {}).items()
    ]
    if lasting:
        tree.gates.append(Or("TOP", (condition, *lasting)))
    joint = isinstance(sources, MarkovSource)
    law = (
        "the sensors' joint states are one source"
        if joint
        else "the sensors' states are independent of each other: common causes are left out"
    )
    model = HybridFaultTree(
        name=name or f"{condition} of {', '.join(table.names)}",
        step_s=step_s,
        mission_s=mission_s,
        components=tuple(tree.components.values()),
        sources=(sources,) if isinstance(sources, MarkovSource) else tuple(
            sources[sensor] for sensor in table.names if sensor in tree.used
        ),
        events=tuple(tree.events.values()),
        gates=tuple(tree.gates),
        top="TOP" if lasting else condition,
        cases=(condition, *lasting),
        notes=(
            f"truth table: {table.provenance}",
            law,
            *NOTES,
            *([f"{condition} was never met by states: what is left is hardware"] if never else []),
        ),
    )  # fmt: skip
    check_model(model)
    return model


def _check_names(
    table: TruthTable,
    sources: Mapping[str, MarkovSource] | MarkovSource,
    rates: Mapping[str, float],
) -> None:
    known = set(table.names)
    if not isinstance(sources, MarkovSource):
        if set(sources) != known or any(s.name != sensor for sensor, s in sources.items()):
            raise InputError(
                "the sources are not those of the table's sensors",
                evidence=f"{', '.join(sources)}; the table's are {', '.join(table.names)}",
                cure="one sensor_source(name, ...) a sensor, under its name",
            )
    elif any(
        len(state) != len(table.names) or not set(state) <= LETTERS.keys()
        for state in sources.states
    ):
        raise InputError(
            "the joint source has no letter a sensor",
            evidence=f"{sources.states[0]!r} for {', '.join(table.names)}",
            cure="combination_source(sensor_state), sensors in the table's order",
        )
    if unknown := sorted(set(rates) - known):
        raise InputError(
            f"no sensor {unknown[0]!r} that could fail", cure=f"one of {', '.join(table.names)}"
        )


def _ever(table: TruthTable, condition: Condition, source: MarkovSource) -> bool:
    """Whether some joint state of the source meets the condition; no data counts as U."""
    seen = np.array([[_level(letter) for letter in state] for state in source.states], np.int8)
    return bool(holds(table, condition)[combination_codes(seen.T)].any())


class _Tree:
    """Events and gates in the making; what is asked of a sensor is written once."""

    def __init__(
        self,
        names: tuple[str, ...],
        sources: Mapping[str, MarkovSource] | MarkovSource,
        rates: Mapping[str, float],
    ) -> None:
        self.names, self.sources, self.rates = names, sources, rates
        self.components: dict[str, Component] = {}
        self.events: dict[str, Event] = {}
        self.gates: list[Gate] = []
        self.used: set[str] = set()
        self.levels: dict[tuple[int, int], str] = {}

    def product(self, name: str, implicant: Implicant) -> str:
        """Gate of one product of conditions on the sensors."""
        inputs = tuple(
            literal
            for k in implicant.literals
            for literal in self._literals(k, implicant.lowest[k], implicant.highest[k])
        )
        self.gates.append(And(name, inputs))
        return name

    def lasting(self, letters: str, seconds: float, step_s: float) -> str:
        """Gate that is true once a combination, or a worse one, has lasted for so long."""
        if len(letters) != len(self.names) or not set(letters) <= LETTERS.keys():
            raise InputError(
                f"{letters!r} is no combination of {', '.join(self.names)}",
                cure="a letter a sensor: N, D for DA, U, - for no data",
            )
        if not (math.isfinite(seconds) and seconds >= 0):
            raise InputError(
                f"how long {letters} may last is not known", evidence=f"{seconds} s",
                cure="leave the combination out where no time can be estimated or none is reached",
            )  # fmt: skip
        lowest = [_level(letter) for letter in letters]
        if not any(lowest):
            raise InputError(f"the combination {letters} has no fault", cure="leave it out")
        inputs = tuple(
            literal for k, low in enumerate(lowest) if low for literal in self._literals(k, low, U)
        )
        # Whole steps, rounded down: the gate must not be true later than the critical time.
        whole = duration_epochs(seconds, step_s, "age") - 1
        steps = whole if whole * step_s <= seconds * (1 + 1e-9) else whole - 1
        together = f"{letters} or worse"
        self.gates.append(And(together, inputs))
        self.gates.append(Dur(f"{together} lasts", steps * step_s, together, rule="age"))
        return f"{together} lasts"

    def _literals(self, k: int, lowest: int, highest: int) -> Iterable[str]:
        """Names of the gates that hold a sensor between two levels."""
        if lowest > N:
            yield self._at_least(k, lowest)
        if highest < U:
            yield self._not(self._at_least(k, highest + 1))

    def _not(self, name: str) -> str:
        negated = f"not {name}"
        if not any(isinstance(gate, Not) and gate.input == name for gate in self.gates):
            self.gates.append(Not(negated, name))
        return negated

    def _at_least(self, k: int, level: int) -> str:
        """Gate "hardware failed, or the state is this one or worse"."""
        sensor = self.names[k]
        if (k, level) in self.levels:
            return self.levels[k, level]
        name = self.levels[k, level] = f"{sensor} {'U' if level == U else 'DA or U'}"
        inputs = []
        states = self._states(k, level)
        if states:
            source = self.sources.name if isinstance(self.sources, MarkovSource) else sensor
            self.events[f"{name} by state"] = InState(f"{name} by state", source, states)
            self.used.add(sensor)
            inputs.append(f"{name} by state")
        if sensor in self.rates:
            self.components[sensor] = Component(f"{sensor} hardware", self.rates[sensor])
            self.events[f"{sensor} failed"] = Failed(f"{sensor} failed", f"{sensor} hardware")
            inputs.append(f"{sensor} failed")
        if not inputs:
            raise InputError(
                f"{sensor} was never seen to be {WORDS[level]} or worse, and has no failure rate: "
                "a probability of 0 would mean not seen",
                where=sensor, cure="more runs, or a failure rate",
            )  # fmt: skip
        self.gates.append(Or(name, tuple(inputs)))
        return name

    def _states(self, k: int, level: int) -> tuple[str, ...]:
        """Names of the source's states in which a sensor is at a level or worse, or silent."""
        if isinstance(self.sources, MarkovSource):
            return tuple(s for s in self.sources.states if _level(s[k]) >= level)
        better = {WORDS[N], WORDS[DA]} if level == U else {WORDS[N]}
        return tuple(s for s in self.sources[self.names[k]].states if s not in better)


def _level(letter: str) -> int:
    """State that a letter counts as: no data as U."""
    return U if LETTERS[letter] == NO_DATA else LETTERS[letter]
