"""Files of models: TOML that tomllib reads back, and hostile files refused in words."""

from __future__ import annotations

import json
import math
import os
import threading
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.dependability.tree.text_files import (
    errors_name,
    found_file,
    read_table,
    toml_text,
    with_suffix,
    write_text,
)
from sbas.exceptions import InputError, ModelError

READERS = {".toml": tomllib.loads, ".json": json.loads}

words = st.text(st.characters(codec="utf-8"), max_size=8)
plain = st.one_of(
    words, st.booleans(), st.floats(allow_nan=False, allow_infinity=False),
    st.integers(-(2**63), 2**63 - 1),
)  # fmt: skip
keys = st.text("abcxyz_019", min_size=1, max_size=5)
inline = st.recursive(
    plain, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3)
)
items = st.dictionaries(keys, inline, max_size=3)
tables = st.dictionaries(keys, inline | items | st.lists(items, min_size=1, max_size=3), max_size=4)


def all_tables(value: Any) -> bool:
    """Whether a list that begins with a table holds nothing else, as in all models."""
    return (
        not isinstance(value, list)
        or not value
        or not isinstance(value[0], dict)
        or all(isinstance(item, dict) for item in value)
    )


@given(tables)
def test_tomllib_reads_what_was_written(table: dict[str, Any]) -> None:
    table = {key: value for key, value in table.items() if all_tables(value)}
    assert tomllib.loads(toml_text(table)) == table


def test_what_is_none_is_left_out_at_every_level() -> None:
    table = {"a": None, "b": {"c": None, "d": [{"e": None, "f": 1}]}, "g": [{"h": None}]}
    assert tomllib.loads(toml_text(table)) == {"b": {"d": [{"f": 1}]}, "g": [{}]}
    with pytest.raises(ValueError, match="JSON compliant"):
        toml_text({"a": math.nan})


def test_a_path_of_keys_is_too_deep(tmp_path: Path) -> None:
    """TOML writes 2000 tables in each other in one line; their repr() would not end well."""
    file = tmp_path / "own.toml"
    file.write_text(".".join(["a"] * 2000) + " = 1\n")
    with pytest.raises(ModelError, match="too deep"):
        read_table(file, "a model", READERS, largest=10_000)
    file.write_text(".".join(["a"] * 20) + " = 1\n")
    assert "a" in read_table(file, "a model", READERS, largest=10_000)
    lists = tmp_path / "own.json"
    lists.write_text("[" * 40 + "]" * 40)
    with pytest.raises(ModelError, match="too deep"):
        read_table(lists, "a model", READERS, largest=10_000)


def test_a_size_that_is_not_known_before_is_bounded(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.write_bytes(b"#" * 101))
    writer.start()
    with pytest.raises(InputError, match="too large for a model"):
        read_table(pipe, "a model", READERS, largest=100)
    writer.join()
    with pytest.raises(InputError, match="cannot be read") as caught:
        read_table(tmp_path / "none.toml", "a model", READERS, largest=100)
    assert ".toml or .json" in caught.value.cure


def test_files_are_found_by_path_and_by_name(tmp_path: Path) -> None:
    assert found_file("galoroi", "a model", "models", READERS).name == "galoroi.toml"
    own = tmp_path / "own.json"
    assert found_file(own, "a model", "models", READERS) == own
    with pytest.raises(InputError, match="no bundled model 'galoro'") as caught:
        found_file("galoro", "a model", "models", READERS)
    assert "did you mean 'galoroi'?" in caught.value.cure
    with pytest.raises(InputError, match=r"a file of a model ends in \.toml or \.json"):
        with_suffix(tmp_path / "own.xml", "a model", READERS)


def test_what_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_text("a = 1\n", tmp_path / "nowhere" / "own.toml", "a model")
    with pytest.raises(ModelError, match="UTF-8"):
        write_text("\ud800", tmp_path / "own.toml", "a model")
    write_text("ö\n", tmp_path / "own.toml", "a model")
    assert (tmp_path / "own.toml").read_bytes() == b"\xc3\xb6\n"


def test_an_error_names_the_file_before_the_key(tmp_path: Path) -> None:
    with pytest.raises(ModelError) as caught, errors_name(tmp_path / "own.toml"):
        raise ModelError("wrong", where="a.b", evidence="1", cure="2")
    assert caught.value.where == "own.toml: a.b"
    assert (caught.value.evidence, caught.value.cure) == ("1", "2")
