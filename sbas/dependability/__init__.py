"""From receiver states and failure rates to the dependability of a localisation unit."""

from sbas.dependability.exact.exact import solve
from sbas.dependability.model_input import load_any, with_receiver
from sbas.dependability.questions import Dependability, depend
from sbas.dependability.receiver.state_estimation import ReceiverStates, receiver_states
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Options,
    Or,
    Pand,
    Stage,
    Undeveloped,
)
from sbas.dependability.tree.model_files import dump_model, load_model, load_models

__all__ = [
    "And",
    "AtLeast",
    "CausalAnd",
    "Component",
    "Con",
    "Dependability",
    "Dur",
    "Failed",
    "House",
    "HybridFaultTree",
    "InState",
    "MarkovSource",
    "Not",
    "Options",
    "Or",
    "Pand",
    "ReceiverStates",
    "Stage",
    "Undeveloped",
    "depend",
    "dump_model",
    "load_any",
    "load_model",
    "load_models",
    "receiver_states",
    "solve",
    "with_receiver",
]
