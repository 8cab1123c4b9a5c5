from __future__ import annotations

import math

import pytest

from sbas.dependability.exchange.open_psa import read_open_psa
from sbas.exceptions import ModelError


def probability(law: str, *, parameters: str = "", mission_s: float | None = 7200.0) -> float:
    text = (
        "<opsa-mef><define-fault-tree name='t'><define-gate name='T'><event name='a'/>"
        f"</define-gate><define-basic-event name='a'>{law}</define-basic-event>"
        f"</define-fault-tree><model-data>{parameters}</model-data></opsa-mef>"
    )
    return read_open_psa(text.encode(), mission_s=mission_s).tree.events[0].probability


def numbers(*values: float) -> str:
    return "".join(f"<float value='{value!r}'/>" for value in values)


MISSION = "<system-mission-time/>"


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ("<float value='1e-3'/>", 1e-3),
        ("<int value='1'/>", 1.0),
        ("<bool value='true'/>", 1.0),
        (f"<exponential>{numbers(1e-18)}{MISSION}</exponential>", 2e-18),
        (f"<exponential>{numbers(0.5)}{MISSION}</exponential>", 1 - math.exp(-1)),
        (f"<GLM>{numbers(0.25, 0.5, 1.5)}{MISSION}</GLM>",
         (0.5 - (0.5 - 0.25 * 2) * math.exp(-4)) / 2),
        (f"<GLM>{numbers(0.125, 0, 0)}{MISSION}</GLM>", 0.125),
        (f"<Weibull>{numbers(4, 2, 1)}{MISSION}</Weibull>", 1 - math.exp(-1 / 16)),
        (f"<Weibull>{numbers(4, 2, 3)}{MISSION}</Weibull>", 0.0),
        (f"<Weibull>{numbers(1e-300, 9, 0)}{MISSION}</Weibull>", 1.0),
    ],
)  # fmt: skip
def test_laws_by_their_definition(law: str, expected: float) -> None:
    assert probability(law) == pytest.approx(expected, rel=1e-14)


def parameter(name: str, value: str, extra: str = "") -> str:
    return f"<define-parameter name='{name}' {extra}>{value}</define-parameter>"


def test_parameters_are_looked_up() -> None:
    law = f"<exponential><parameter name='rate'/>{MISSION}</exponential>"
    given = parameter("rate", "<parameter name='base'/>") + parameter("base", numbers(0.5))
    assert probability(law, parameters=given) == pytest.approx(1 - math.exp(-1), rel=1e-15)


@pytest.mark.parametrize(
    ("law", "parameters", "message"),
    [
        ("<parameter name='p'/>", parameter("p", "<parameter name='p'/>"), "in a cycle"),
        ("<parameter name='p0'/>",
         "".join(parameter(f"p{i}", f"<parameter name='p{i + 1}'/>") for i in range(5000)),
         "without end"),
        ("<parameter name='p'/>", "", "'p' is used and not defined"),
        ("<parameter name='p'/>", parameter("p", numbers(0.1), "unit='years-1'"), "not converted"),
        ("<lognormal-deviate><float value='1'/></lognormal-deviate>", "", "'lognormal-deviate'"),
        (f"<exponential>{numbers(1)}</exponential>", "", "takes 2 arguments, not 1"),
        (f"<exponential>{numbers(-1)}{MISSION}</exponential>", "", "negative argument"),
        (f"<GLM>{numbers(2, 1, 1)}{MISSION}</GLM>", "", "gamma of a GLM"),
        (f"<Weibull>{numbers(0, 1, 1)}{MISSION}</Weibull>", "", "above 0"),
        (f"<exponential><exponential>{numbers(1, 1)}</exponential>{MISSION}</exponential>", "",
         "itself a law"),
        ("<float value='nan'/>", "", "no finite number"),
        ("<float value='1_0'/>", "", "no finite number"),
        ("<float value='x'/>", "", "no finite number"),
        ("<float/>", "", "has no 'value'"),
        ("<bool value='maybe'/>", "", "neither true nor false"),
    ],
)  # fmt: skip
def test_expressions_that_cannot_be_meant(law: str, parameters: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        probability(law, parameters=parameters)


@pytest.mark.parametrize("mission_s", [0.0, -1.0, float("inf"), float("nan")])
def test_a_mission_lasts(mission_s: float) -> None:
    with pytest.raises(ModelError, match="not a time above 0"):
        probability(numbers(0.1), mission_s=mission_s)
