from __future__ import annotations

from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from sbas.dependability.exchange.marking_cases import Bounds, separate_cases
from sbas.dependability.simulation.petri_net import AtLeastOf, Condition, NotOf, Tokens

PLACES = ("p", "q", "r")
CONDITIONS = st.recursive(
    st.builds(Tokens, st.sampled_from(PLACES), st.integers(0, 3)),
    lambda inner: (
        st.builds(NotOf, inner)
        | st.builds(
            lambda k, terms: AtLeastOf(k, tuple(terms)),
            st.integers(0, 3),
            st.lists(inner, max_size=3),
        )
    ),
    max_leaves=8,
)


def holds(condition: Condition, marking: dict[str, int]) -> bool:
    if isinstance(condition, Tokens):
        return marking[condition.place] >= condition.at_least
    if isinstance(condition, NotOf):
        return not holds(condition.term, marking)
    return sum(holds(term, marking) for term in condition.terms) >= condition.k


def inside(bounds: Bounds, marking: dict[str, int]) -> bool:
    return all(
        low <= marking[place] and (high is None or marking[place] < high)
        for place, (low, high) in bounds.items()
    )


@given(CONDITIONS)
def test_every_marking_lies_in_one_case_of_the_right_side(condition: Condition) -> None:
    cases = separate_cases(condition, "here")
    for tokens in product(range(5), repeat=3):
        marking = dict(zip(PLACES, tokens, strict=True))
        right, wrong = cases.true, cases.false
        if not holds(condition, marking):
            right, wrong = wrong, right
        assert sum(inside(bounds, marking) for bounds in right) == 1
        assert not any(inside(bounds, marking) for bounds in wrong)
