"""Galileo dynamic fault trees in: and, or, KofN, priority-and, and basic events with rates."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from sbas.dependability.exchange.losses import ImportedModel, Loss, LossReport
from sbas.dependability.exchange.safe_xml import content_of
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Event,
    Failed,
    Gate,
    HybridFaultTree,
    Or,
    Pand,
    Undeveloped,
)
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import ModelError

TimeUnit = Literal["s", "min", "h", "d", "y"]
HOURS: dict[str, float] = {"s": 1 / 3600, "min": 1 / 60, "h": 1.0, "d": 24.0, "y": 8760.0}
"""Hours in each unit; a year has 365 days."""

_PAND = {
    "pand": None, "pand-incl": False, "pand-inc": False, "pand<=": False,
    "pand-excl": True, "pand-ex": True, "pand<": True,
}  # fmt: skip
_KNOWN_ELSEWHERE = (
    "por", "por-incl", "por-excl", "wsp", "csp", "hsp", "spare", "seq", "seqand", "seqor",
    "mutex", "fdep", "pdep", "phases", "rate", "shape", "mean", "stddev", "cov", "res", "repl",
    "interval", "param",
)  # fmt: skip
_TOKEN = re.compile(r'"([^"\n]*)"|([^\s;"]+)|(;)')
_MAX_TOKENS = 4_000_000


@dataclass(frozen=True)
class _Statement:
    """The words of a statement, and the line on which it starts."""

    words: tuple[str, ...]
    line: int


def read_galileo(
    source: Path | str | bytes,
    *,
    time_unit: TimeUnit,
    step_s: float,
    mission_s: float,
    exclusive: bool = False,
) -> ImportedModel:
    """The hybrid fault tree of a Galileo file.

    Parameters
    ----------
    source : path of a file, or its content as bytes.
    time_unit : in which the file's rates count: "s", "min", "h", "d" or "y" (of 365 days); no
        file says it.
    step_s, mission_s : epoch and mission [s]; no file says them either.
    exclusive : how a plain "pand" takes inputs that begin together: as not in order.

    Returns
    -------
    ImportedModel: a basic event "E" with a rate watches a component "E-hardware".

    Raises
    ------
    InputError : a file that cannot be read.
    ModelError : a gate or attribute that is unknown or not supported, named with its line; N of
        KofN other than the number of inputs; a name undefined or defined twice; a cycle.

    References
    ----------
    Sullivan, Dugan, Coppit 1999, The Galileo fault tree analysis tool; dialect of Storm
    (DFTGalileoParser) and DFTCalc (repair=).
    """
    if time_unit not in get_args(TimeUnit):
        raise ModelError(
            f"time_unit = {time_unit!r} is unknown", cure=f"known are {', '.join(HOURS)}"
        )
    content, where = content_of(source)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ModelError("the file is not UTF-8 text", where=where, evidence=str(error)) from None
    top = ""
    taken: dict[str, int] = {}
    components: list[Component] = []
    events: list[Event] = []
    gates: list[Gate] = []
    losses: list[Loss] = []
    for statement in _statements(text, where):
        here = f"{where}:{statement.line}"
        words = statement.words
        if len(words) < 2:
            raise ModelError("a statement of a single word", where=here, evidence=words[0][:40])
        if words[0] == "toplevel":
            if top or len(words) != 2:
                raise ModelError("one toplevel with one name is expected", where=here)
            top = words[1]
            continue
        name, rest = words[0], words[1:]
        if name in taken:
            raise ModelError(
                f"{name!r} is defined twice", where=here, evidence=f"first on line {taken[name]}"
            )
        taken[name] = statement.line
        if "=" in rest[0] and not rest[0].startswith("pdep=") and rest[0] not in _PAND:
            event, component, told = _basic_event(name, rest, HOURS[time_unit], here)
            events.append(event)
            components += component
            losses += told
        else:
            gates.append(_gate(name, rest, exclusive, here))
    if not top:
        raise ModelError("the file has no toplevel", where=where, cure='begin with toplevel "T";')
    if top not in taken:
        raise ModelError(f"the toplevel {top!r} is not defined", where=where)
    model = HybridFaultTree(
        name="galileo" if isinstance(source, bytes) else Path(source).stem,
        step_s=step_s,
        mission_s=mission_s,
        components=tuple(components),
        sources=(),
        events=tuple(events),
        gates=tuple(gates),
        top=top,
    )
    check_model(model)
    return ImportedModel(model, LossReport("Galileo", tuple(losses)))


def _statements(text: str, where: str) -> Iterator[_Statement]:
    words: list[str] = []
    start, line, at, count = 1, 1, 0, 0
    while True:
        at, line = _skip(text, at, line, where)
        if at == len(text):
            break
        match = _TOKEN.match(text, at)
        if match is None:
            raise ModelError("a quotation mark is not closed", where=f"{where}:{line}")
        count += 1
        if count > _MAX_TOKENS:
            raise ModelError(f"the file has more than {_MAX_TOKENS} words", where=where)
        quoted, word, end = match.groups()
        if end:
            if words:
                yield _Statement(tuple(words), start)
            words = []
        else:
            if not words:
                start = line
            # A word ends where a comment begins: both stand together in files of the field.
            cut = len(word) if quoted is None else 0
            if quoted is None:
                begins = [i for i in (word.find("//"), word.find("/*")) if i > 0]
                cut = min([cut, *begins])
            words.append(quoted if quoted is not None else word[:cut])
            if quoted is None and cut < len(word):
                at = match.start() + cut
                continue
        at = match.end()
    if words:
        raise ModelError(
            "the last statement is not ended by ';'", where=f"{where}:{start}", evidence=words[0]
        )


def _skip(text: str, at: int, line: int, where: str) -> tuple[int, int]:
    """Past blanks and comments."""
    while at < len(text):
        if text[at].isspace():
            line += text[at] == "\n"
            at += 1
        elif text.startswith("//", at):
            end = text.find("\n", at)
            at = len(text) if end < 0 else end
        elif text.startswith("/*", at):
            end = text.find("*/", at + 2)
            if end < 0:
                raise ModelError("a comment is not closed", where=f"{where}:{line}")
            line += text.count("\n", at, end)
            at = end + 2
        else:
            break
    return at, line


def _gate(name: str, words: tuple[str, ...], exclusive: bool, where: str) -> Gate:
    kind, inputs = words[0], words[1:]
    if not inputs:
        raise ModelError(f"gate {name!r} has no input", where=where)
    if kind == "and":
        return And(name, inputs)
    if kind == "or":
        return Or(name, inputs)
    if kind in _PAND:
        asked = _PAND[kind]
        return Pand(name, inputs, False, exclusive if asked is None else asked)
    vote = re.fullmatch(r"(?:vot([0-9]{1,6})|([0-9]{1,6})of([0-9]{1,6}))", kind)
    if vote:
        if vote[3] is not None and int(vote[3]) != len(inputs):
            raise ModelError(
                f"gate {name!r} is {kind!r} of {len(inputs)} inputs",
                where=where,
                cure=f"write {vote[2]}of{len(inputs)}, or give {vote[3]} inputs",
            )
        return AtLeast(name, int(vote[1] or vote[2]), inputs)
    raise _unknown(f"gate {kind!r}", kind, name, where)


def _basic_event(
    name: str, words: tuple[str, ...], hours: float, where: str
) -> tuple[Event, list[Component], list[Loss]]:
    given: dict[str, float] = {}
    losses = []
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or key not in ("lambda", "prob", "dorm", "repair"):
            raise _unknown(f"attribute {key!r}", key, name, where)
        if key in given:
            raise ModelError(f"{key!r} of {name!r} stands twice", where=where)
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not 0 <= number < math.inf or "_" in value:
            raise ModelError(
                f"{key!r} of {name!r} is no number of 0 or more", where=where, evidence=value[:40]
            )
        given[key] = number
    if "dorm" in given:
        losses.append(
            Loss(name, "dorm", "kept", "no effect: without spare gates nothing is ever dormant")
        )
    if ("prob" in given) == ("lambda" in given) or ("prob" in given and "repair" in given):
        raise ModelError(
            f"basic event {name!r} needs lambda (and repair), or prob",
            where=where,
            evidence=" ".join(words)[:80],
        )
    if "prob" in given:
        return Undeveloped(name, given["prob"]), [], losses
    component = Component(
        f"{name}-hardware", given["lambda"] / hours, given.get("repair", 0.0) / hours
    )
    return Failed(name, component.name), [component], losses


def _unknown(what: str, key: str, name: str, where: str) -> ModelError:
    known = key.partition("=")[0] in _KNOWN_ELSEWHERE
    verb = "is not supported" if known else "is unknown"
    return ModelError(
        f"{what} of {name!r} {verb}",
        where=where,
        cure="supported are and, or, KofN, votK, pand, pand-incl, pand-excl; lambda=, prob=, "
        "repair=, dorm=",
    )
