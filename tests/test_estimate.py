"""An Estimate cannot be mislabelled, nor taken for a number."""

from __future__ import annotations

import json

import pytest

from sbas.estimate import Counted, Estimate, Fitted, Quoted, Refusal

COUNTED = Estimate(0.0, None, 3.595e-2, 0.95, "per_h", Counted(0, 83.33))


def test_the_evidence_class_follows_from_the_basis() -> None:
    assert COUNTED.evidence == "demonstrated"
    fitted = Estimate(1e-6, None, 2e-6, 0.95, "per_h", Fitted("tail", {"b": 1.0}, 5.4))
    assert fitted.evidence == "modelled"
    quoted = Estimate(1e-7, None, None, None, "per_h", Quoted("DO-229D", "J.1"))
    assert quoted.evidence == "claimed"
    with pytest.raises(AttributeError):
        COUNTED.evidence = "claimed"  # type: ignore[misc]


def test_a_claim_needs_its_paragraph() -> None:
    with pytest.raises(ValueError, match="paragraph"):
        Quoted("DO-229D", " ")


def test_it_is_no_number() -> None:
    for attempt in (lambda: float(COUNTED), lambda: COUNTED + 1, lambda: COUNTED < 1e-7):  # type: ignore[operator,arg-type]
        with pytest.raises(TypeError, match=r"\.upper"):
            attempt()


@pytest.mark.parametrize(
    ("value", "lower", "upper", "confidence"),
    [
        (2.0, None, 1.0, 0.95), (0.0, 1.0, 2.0, 0.95), (1.0, None, 2.0, None),
        (1.0, None, 2.0, 1.0), (float("nan"), None, None, None), (float("inf"), None, None, None),
    ],
)  # fmt: skip
def test_impossible_figures_are_refused(
    value: float, lower: float | None, upper: float | None, confidence: float | None
) -> None:
    with pytest.raises(ValueError, match=r"bounds|finite|confidence"):
        Estimate(value, lower, upper, confidence, "per_h", Counted(0, 1))


def test_json_carries_the_unit_in_the_key_and_null_for_missing() -> None:
    plain = json.loads(json.dumps(COUNTED.to_dict(), allow_nan=False))
    assert plain["value_per_h"] == 0
    assert plain["upper_per_h"] == 3.595e-2
    assert plain["lower_per_h"] is None
    assert plain["basis"] == {"events": 0, "hours": 83.33, "of": "events"}


def test_printing_says_bound_confidence_and_evidence() -> None:
    text = str(COUNTED)
    assert "upper bound 0.03595/h" in text
    assert "95 %" in text
    assert "demonstrated: 0 events in 83.33 h" in text
    assert (
        "&lt;"
        in Estimate(1.0, None, None, None, "m", Quoted("<b>", "1"), caveats=("<i>",))._repr_html_()
    )


def test_a_refusal_speaks() -> None:
    assert str(Refusal("no truth", "--truth")) == "not given: no truth (--truth)"
    assert Refusal("no truth").to_dict()["refused"] == "no truth"
