from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.dependability.exchange.identifiers import identifiers, is_identifier
from sbas.exceptions import ModelError

NAMES = st.text(st.characters(categories=("L", "N", "P", "S")), min_size=1, max_size=6)


@given(st.lists(NAMES | st.sampled_from(["a b", "a_b", "a-b", "a.b", "1"]), unique=True))
def test_every_name_gets_an_identifier_of_its_own(names: list[str]) -> None:
    found = identifiers(names)
    assert found.keys() == set(names)
    assert len(set(found.values())) == len(names)
    assert all(is_identifier(own) for own in found.values())
    assert all(found[name] == name for name in names if is_identifier(name))


@pytest.mark.parametrize("name", ["a.b", "a--b", "-a", "a-", "1a", "", "a b", "é"])
def test_what_open_psa_does_not_take(name: str) -> None:
    assert not is_identifier(name)


@pytest.mark.parametrize("name", ["", " a", "a\n", "\x00"])
def test_names_that_cannot_be_printed_are_refused(name: str) -> None:
    with pytest.raises(ModelError, match="no printable name"):
        identifiers([name])


def test_many_equal_wishes_are_numbered() -> None:
    found = identifiers(chr(0x4E00 + i) for i in range(20_000))
    assert sorted(found.values())[:3] == ["n", "n_10", "n_100"]
    assert len(set(found.values())) == 20_000
