"""Decimal signs of another country."""

from __future__ import annotations

import re

import numpy as np

from tests.corruption.damage import Damaged, Kind, file_of
from tests.corruption.good_logs import GoodLog

Rng = np.random.Generator


def _decimal_commas(log: GoodLog, rng: Rng) -> Damaged:
    """Every decimal point a comma, also where commas separate the fields or points are needed."""
    body = re.sub(rb"(?<=\d)\.(?=\d)", b",", b"".join(log.pieces.epochs))
    return file_of(log, log.pieces.head + body, "E20", "E10", "E16")


def _commas_in_some(log: GoodLog, rng: Rng) -> Damaged:
    """Decimal commas in some lines, points in the others."""
    epochs = list(log.pieces.epochs)
    old, new = (b",", b".") if log.form.name == "csv semicolon" else (b".", b",")
    pattern = re.compile(rb"(?<=\d)" + re.escape(old) + rb"(?=\d)")
    begin = int(rng.integers(100, 900))
    epochs[begin:] = [pattern.sub(new, epoch) for epoch in epochs[begin:]]
    return file_of(log, log.pieces.head + b"".join(epochs), "E20", "E10", "E16")


def _thousands_grouped(log: GoodLog, rng: Rng) -> Damaged:
    """Heights above a kilometre with a sign between the thousands."""
    high = log.recording.replace(
        table=log.recording.table.assign(height_m=log.recording.table["height_m"] + 1500.0)
    )
    comma = log.form.name == "csv semicolon"
    pattern, group = (rb"(?<=;)1(\d\d\d),", rb"1.\1,") if comma else (rb"\b1(\d\d\d)\.", rb"1,\1.")
    pieces = log.form.write(high)
    body = b"".join(re.sub(pattern, group, epoch) for epoch in pieces.epochs)
    return file_of(log, pieces.head + body, "E20", "E10", keeps=False)


def _text(log: GoodLog) -> bool:
    return log.form.family == "text"


DECIMAL_DAMAGES = (
    Kind("decimal commas", _decimal_commas, lambda log: _text(log)
         and log.form.name != "csv semicolon"),
    Kind("decimal commas in some lines", _commas_in_some, _text),
    Kind("thousands grouped", _thousands_grouped,
         lambda log: log.form.format == "csv" or log.form.name == "pegasus"),
)  # fmt: skip
