"""A model in words."""

from __future__ import annotations

from dataclasses import replace

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
    Or,
    Pand,
    Stage,
    Undeveloped,
)
from sbas.dependability.tree.model_text import model_markdown, model_text

ROWS = ((0.9, 0.1), (0.5, 0.5))
MODEL = HybridFaultTree(
    "unit | 1", 0.5, 60.0, (Component("A", 4e-6, 1 / 24), Component("B", 2e-6)),
    (MarkovSource("O", ("right", "wrong"), ROWS, (0.25, 0.75), ("A",), first_fix_s=3.0),),
    (Failed("a", "A"), Failed("b", "B"), InState("w", "O", ("wrong", "down")), House("h", False),
     Undeveloped("ue"), Undeveloped("p", 0.25), Failed("spare", "B")),
    (Con("run", 3, "w"), Pand("order", ("a", "run")), Dur("long", 5.0, "b", "strict"),
     CausalAnd("both", 2.5, ("a", "b")), AtLeast("two", 2, ("order", "long", "both")),
     Not("not", "order"), And("and", ("h", "ue", "p", "not")), Or("top", ("two", "and"))),
    "top", ("two",), notes=("a_note",),
)  # fmt: skip

TREE = """\
top: OR
  two: 2 of 3
    order: PAND, current, inclusive
      a: A failed (4e-06/h, repair 0.0416667/h)
      run: CON, 3 consecutive epochs
        w: O wrong or down
    long: DUR, 5 s by 'strict'
      b: B failed (2e-06/h, not repaired)
    both: causal AND, 2.5 s by 'age'
      a: A failed (4e-06/h, repair 0.0416667/h)
      b: B failed (2e-06/h, not repaired)
  and: AND
    h: never
    ue: not analysed, taken as never
    p: not analysed, 0.25 a mission
    not: NOT
      order: see above
without effect on the top:
  spare: B failed (2e-06/h, not repaired)
"""


def test_the_tree_with_kinds_delays_and_rates() -> None:
    text = model_text(MODEL)
    assert TREE in text.replace("  without", "without")
    assert text.startswith("unit | 1\nmission 60 s, 120 epochs of 0.5 s\noptions: dur_rule = age,")
    assert "cases: two" in text
    assert "source O: starts right 0.25, wrong 0.75; down unless A work, then down for 3 s" in text
    assert "    0.9 0.1\n    0.5 0.5\n" in text
    assert text.endswith("notes\n  a_note\n")


def test_markdown_has_tables_and_no_markup_from_names() -> None:
    text = model_markdown(MODEL)
    assert text.startswith("# unit \\| 1\n")
    assert "- top: OR\n  - two: 2 of 3\n    - order: PAND" in text
    assert "| A | 4e-06 | 0.0416667 | 0 |  |" in text
    assert "| right | 0.9 | 0.1 |" in text
    assert "| dur\\_rule | age |" in text
    assert "- a\\_note" in text
    for line in text.splitlines():
        if line.startswith("| ---"):
            assert set(line) <= set("| -")


def test_a_profile_is_printed_stage_by_stage() -> None:
    stages = (Stage("town", 20.0, ROWS), Stage("forest", 40.0, ROWS))
    model = replace(MODEL, sources=(replace(MODEL.sources[0], stages=stages),))
    text = model_text(model)
    assert "  town, 20 s\n    0.9 0.1\n" in text
    assert "  forest, 40 s\n" in text


def test_a_deep_tree_is_printed() -> None:
    gates = tuple(Or(f"g{i}", (f"g{i + 1}" if i < 2999 else "a",)) for i in range(3000))
    text = model_text(replace(MODEL, gates=gates, top="g0", cases=()))
    assert "g2999: OR" in text
    assert "cases: none" in text
