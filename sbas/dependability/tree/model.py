"""A hybrid fault tree: components, Markov sources, events, gates with memory, and what is asked.

Everything is plain data. Time runs in epochs n = 0..N of `step_s`; nothing is true before epoch
0. Within an epoch hardware moves first, then sources in their order, then gates.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

DurationRule = Literal["age", "count", "strict"]
MeanRule = Literal["epochs", "left", "trapezoid", "integral"]


# --- what moves -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Component:
    """Hardware that fails and is repaired at constant rates.

    Parameters
    ----------
    name : unique in the model.
    failure_rate_per_h : alpha [1/h], 0 or more.
    repair_rate_per_h : mu [1/h]; 0 is never repaired.
    initially_failed : probability to be failed at epoch 0 [1].
    source : where the figures come from.
    """

    name: str
    failure_rate_per_h: float
    repair_rate_per_h: float = 0.0
    initially_failed: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class Stage:
    """A stretch of an environment profile: for so long the source moves by these rows."""

    label: str
    seconds: float
    rows: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class MarkovSource:
    """Something that moves among states once an epoch, such as a GNSS receiver's output.

    Parameters
    ----------
    name : unique in the model.
    states : names of the states that it moves among; a name may occur more than once, its
        entries are phases of one state (a semi-Markov source).
    rows : (s, s) probabilities from state (row) to state (column) in one epoch.
    initial : (s,) law at epoch 0.
    guard : components that must all work; else the source is in the state `down`.
    down : name of the state outside `states` while the guard fails ("missing by hardware"), and
        while it waits for its first fix after that.
    first_fix_s : wait from the first epoch with the guard true again to the next state [s].
    restart : law of the state after the wait: "stationary", "first" (the first state), "row1"
        (one step from the first state), or (s,) probabilities.
    waiting : name of the state during the wait; None is `down`.
    stages : profile of environments that take the place of `rows` one after the other, the last
        one to the end of the mission; the state carries over. Empty: `rows` throughout.
    source : where the figures come from.
    """

    name: str
    states: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    initial: tuple[float, ...]
    guard: tuple[str, ...] = ()
    down: str = "down"
    first_fix_s: float = 0.0
    restart: Literal["stationary", "first", "row1"] | tuple[float, ...] = "stationary"
    waiting: str | None = None
    stages: tuple[Stage, ...] = ()
    source: str = ""


# --- what is observed of it -------------------------------------------------------------------


@dataclass(frozen=True)
class Failed:
    """Event: a component is failed."""

    name: str
    component: str


@dataclass(frozen=True)
class InState:
    """Event: a Markov source is in one of these states (its `down` and `waiting` included)."""

    name: str
    source: str
    states: tuple[str, ...]


@dataclass(frozen=True)
class House:
    """Event that is true or false throughout."""

    name: str
    value: bool


@dataclass(frozen=True)
class Undeveloped:
    """Event that was not analysed; with a probability it is drawn once a mission and held."""

    name: str
    probability: float = 0.0


Event = Failed | InState | House | Undeveloped


# --- gates ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Or:
    """True while any input is."""

    name: str
    inputs: tuple[str, ...]


@dataclass(frozen=True)
class And:
    """True while all inputs are."""

    name: str
    inputs: tuple[str, ...]


@dataclass(frozen=True)
class Not:
    """True while its input is false."""

    name: str
    input: str

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.input,)


@dataclass(frozen=True)
class AtLeast:
    """True while k or more inputs are (k-of-n)."""

    name: str
    k: int
    inputs: tuple[str, ...]


@dataclass(frozen=True)
class Con:
    """CON_N: true from the N-th consecutive epoch of its input on."""

    name: str
    count: int
    input: str

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.input,)


@dataclass(frozen=True)
class Dur:
    """DUR_T: true once its input has lasted T; `rule` None takes the model's option."""

    name: str
    seconds: float
    input: str
    rule: DurationRule | None = None

    @property
    def inputs(self) -> tuple[str, ...]:
        return (self.input,)


@dataclass(frozen=True)
class CausalAnd:
    """Causal AND_T: true once all inputs together have lasted T (the joint run counts)."""

    name: str
    seconds: float
    inputs: tuple[str, ...]
    rule: DurationRule | None = None


@dataclass(frozen=True)
class Pand:
    """Priority AND: true while all inputs are and became so in this order, left cascade.

    `latched`: once true, true to the end. `exclusive`: simultaneous onsets are no order. None
    takes the model's option.
    """

    name: str
    inputs: tuple[str, ...]
    latched: bool | None = None
    exclusive: bool | None = None


Gate = Or | And | Not | AtLeast | Con | Dur | CausalAnd | Pand
"""All have `name` and `inputs` (names of events or gates)."""


# --- the whole --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Options:
    """How open points of the semantics are read; printed with every result.

    Parameters
    ----------
    dur_rule : of every DUR and causal AND without its own: "age" (time since the first true
        epoch >= T, a Petri net delay), "count" (T worth of true epochs), "strict" (> T).
    pand_latched, pand_exclusive : of every PAND without its own.
    con_gap, hold_states : what a CON does at an epoch in which the source of its `InState` input
        is in one of `hold_states` (such as "missing"): "reset" ends the run, "hold" skips the
        epoch, the count stays as it is and the output is false there.
    mean_rule : epochs n = 1..N ("epochs"), 0..N-1 ("left"), "trapezoid", or with hardware
        integrated within the epoch ("integral").
    """

    dur_rule: DurationRule = "age"
    pand_latched: bool = False
    pand_exclusive: bool = False
    con_gap: Literal["reset", "hold"] = "reset"
    hold_states: tuple[str, ...] = ()
    mean_rule: MeanRule = "epochs"


@dataclass(frozen=True)
class HybridFaultTree:
    """A hybrid fault tree with its mission; the one type that every solver and format takes.

    Parameters
    ----------
    name : of the model.
    step_s, mission_s : epoch and length of the mission [s]; a whole number of epochs.
    components, sources, events, gates : in any order of mention; names are unique over all four,
        sources are guarded by components only.
    top : name of the event or gate that is the failure.
    cases : names that results list beside the top, such as cases A, B and C.
    options : readings of open points.
    notes : sentences that travel with the model, such as what was calibrated.
    """

    name: str
    step_s: float
    mission_s: float
    components: tuple[Component, ...]
    sources: tuple[MarkovSource, ...]
    events: tuple[Event, ...]
    gates: tuple[Gate, ...]
    top: str
    cases: tuple[str, ...] = ()
    options: Options = field(default_factory=Options)
    notes: tuple[str, ...] = ()

    @property
    def epochs(self) -> int:
        """N, number of epochs after epoch 0."""
        return round(self.mission_s / self.step_s)
