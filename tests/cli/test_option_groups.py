"""Groups of options: spread for the command line, whole for the verb."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Annotated, Any

import pytest
import typer
from typer.testing import CliRunner

from sbas.cli.option_groups import with_option_groups


@dataclass(frozen=True)
class Size:
    """A group of two options."""

    wide: Annotated[float, typer.Option(help="Width in metres.")] = 2.0
    deep: Annotated[bool, typer.Option("--deep")] = False


def test_a_group_is_spread_and_handed_over_whole() -> None:
    seen: list[Any] = []

    @with_option_groups
    def verb(name: str, size: Size, times: int = 1) -> None:
        """What it does."""
        seen.append((name, size, times))

    assert list(inspect.signature(verb).parameters) == ["name", "times", "wide", "deep"]
    assert verb.__doc__ == "What it does."
    app = typer.Typer()
    app.command()(verb)
    assert CliRunner().invoke(app, ["a", "--wide", "3.5", "--deep"]).exit_code == 0
    assert CliRunner().invoke(app, ["b", "--times", "4"]).exit_code == 0
    assert seen == [("a", Size(3.5, True), 1), ("b", Size(), 4)]


def test_one_name_in_two_groups_is_refused() -> None:
    def verb(size: Size, wide: float = 1.0) -> None:
        pass

    with pytest.raises(ValueError, match="duplicate parameter name"):
        with_option_groups(verb)
