from __future__ import annotations

import pytest

from sbas.dependability.exchange.galileo import read_galileo
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Failed,
    HybridFaultTree,
    Or,
    Pand,
    Undeveloped,
)
from sbas.exceptions import ModelError


def read(text: str, time_unit: str = "h") -> HybridFaultTree:
    return read_galileo(
        text.encode(),
        time_unit=time_unit,  # type: ignore[arg-type]
        step_s=1,
        mission_s=3600,
    ).model


TEXT = """// a comment; "with" marks
toplevel "T";  /* another;
  of two lines */
"T" or "P" "V" "G";
P pand "A" "B";"Q" pand-excl A B; "V" 2of3 "A" "B" "D";
"W" vot1 "A" "B"; "G" and "Q" "W";
"A" lambda=2e-3 dorm=0.5;
"B" lambda = 1;
"D" prob=0.25;
"""


def test_gates_and_events_in_any_layout() -> None:
    model = read(TEXT.replace("lambda = 1", "lambda=1 repair=0.5"))
    assert model.top == "T"
    assert model.components == (
        Component("A-hardware", 2e-3),
        Component("B-hardware", 1.0, 0.5),
    )
    assert model.events == (
        Failed("A", "A-hardware"),
        Failed("B", "B-hardware"),
        Undeveloped("D", 0.25),
    )
    assert set(model.gates) == {
        Or("T", ("P", "V", "G")),
        Pand("P", ("A", "B"), False, False),
        Pand("Q", ("A", "B"), False, True),
        AtLeast("V", 2, ("A", "B", "D")),
        AtLeast("W", 1, ("A", "B")),
        And("G", ("Q", "W")),
    }


def test_a_plain_pand_takes_the_reading_that_was_asked_for() -> None:
    text = 'toplevel "T"; "T" pand "A" "B"; "A" lambda=1; "B" lambda=1;'
    for exclusive in (False, True):
        model = read_galileo(
            text.encode(), time_unit="h", step_s=1, mission_s=60, exclusive=exclusive
        ).model
        assert model.gates == (Pand("T", ("A", "B"), False, exclusive),)


@pytest.mark.parametrize(
    ("unit", "per_h"), [("s", 3600), ("min", 60), ("h", 1), ("d", 1 / 24), ("y", 1 / 8760)]
)
def test_rates_count_in_the_unit_that_is_said(unit: str, per_h: float) -> None:
    model = read('toplevel "T"; "T" or "A"; "A" lambda=0.5 repair=2;', unit)
    assert model.components[0].failure_rate_per_h == pytest.approx(0.5 * per_h, rel=1e-15)
    assert model.components[0].repair_rate_per_h == pytest.approx(2 * per_h, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('"T" or "A"; "A" lambda=1;', "no toplevel"),
        ('toplevel "X"; "T" or "A"; "A" lambda=1;', "toplevel 'X' is not defined"),
        ('toplevel "T"; toplevel "T"; "T" or "A";', "one toplevel"),
        ('toplevel "T"; "T" 2of3 "A" "A";', "'2of3' of 2 inputs"),
        ('toplevel "T"; "T" 4of3 "A" "B" "C"; "A" prob=0; "B" prob=0; "C" prob=0;', "k"),
        ('toplevel "T"; "T" wsp "A" "B";', "gate 'wsp' of 'T' is not supported"),
        ('toplevel "T"; "T" fdep "A" "B";', "gate 'fdep' of 'T' is not supported"),
        ('toplevel "T"; "T" pdep=0.5 "A" "B";', "gate 'pdep=0.5' of 'T' is not supported"),
        ('toplevel "T"; "T" nimbus "A";', "gate 'nimbus' of 'T' is unknown"),
        ('toplevel "T"; "T" lambda=1 phases=3;', "attribute 'phases' of 'T' is not supported"),
        ('toplevel "T"; "T" lambda=1 colour=3;', "attribute 'colour' of 'T' is unknown"),
        ('toplevel "T"; "T" lambda=1 lambda=3;', "'lambda' of 'T' stands twice"),
        ('toplevel "T"; "T" lambda=-1;', "no number of 0 or more"),
        ('toplevel "T"; "T" lambda=inf;', "no number of 0 or more"),
        ('toplevel "T"; "T" dorm=1;', "needs lambda"),
        ('toplevel "T"; "T" prob=0.1 lambda=1;', "needs lambda"),
        ('toplevel "T"; "T" or;', "has no input"),
        ('toplevel "T"; "T";', "single word"),
        ('toplevel "T"; "T" or "A"', "not ended by ';'"),
        ('toplevel "T"; "T or "A";', "not closed|unknown"),
        ('toplevel "T"; /* "T" or "A";', "comment is not closed"),
        ('toplevel "T"; "T" or "A"; "T" or "A";', "'T' is defined twice"),
        ('toplevel "T"; "T" or "A";', "A"),
        ('toplevel "T"; "T" or "U"; "U" or "T";', "cycle"),
        ('toplevel "T"; "T" pand "A"; "A" lambda=1;', "T"),
        ("\x00;", "single word"),
        ("", "no toplevel"),
    ],
)
def test_files_that_cannot_be_meant(text: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        read(text)


def test_errors_name_the_line() -> None:
    with pytest.raises(ModelError, match="'spare'") as caught:
        read('toplevel "T";\n/* a\nb */ // c\n"T"\n spare "A" "B";')
    assert caught.value.where.endswith(":4")


def test_a_file_says_no_unit_and_no_text() -> None:
    with pytest.raises(ModelError, match="time_unit = 'week'"):
        read("", "week")
    with pytest.raises(ModelError, match="not UTF-8"):
        read_galileo(b"\xff\xfe", time_unit="h", step_s=1, mission_s=60)


def test_a_hundred_thousand_statements_in_a_chain() -> None:
    n = 100_000
    chain = "".join(f'"g{i}" or "g{i + 1}" "a";\n' for i in range(n))
    model = read(f'toplevel "g0";\n{chain}"g{n}" or "a";\n"a" lambda=1;')
    assert len(model.gates) == n + 1
