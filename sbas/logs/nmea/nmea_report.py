"""What an NMEA file said about itself, and what the reader removed, missed or left over."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sbas.findings import Finding, Severity
from sbas.logs.nmea.nmea_between import Between
from sbas.logs.nmea.nmea_columns import Tally
from sbas.logs.nmea.nmea_dates import Span
from sbas.logs.sentinels import sentinel_findings
from sbas.timescales import LEAP_TABLE_EXPIRES, gpst_minus_utc_s

BAD_SHARE = 0.01
"""Share of rejected sentences or orphan bytes above which a file counts as damaged."""

_GRAVE = ("lat_deg", "lon_deg", "height_m")
_DEGREE_M = 111_000.0


def findings(
    tally: Tally, between: Between, span: Span, *, size: int, geoid: float | None, sbas: bool
) -> tuple[Finding, ...]:
    """Findings on a file that was read through.

    Parameters
    ----------
    tally, between, span : what was counted.
    size : bytes of the file.
    geoid, sbas : options of the reader.
    """
    return (
        *_damage(tally, between, size),
        *_time(tally, span),
        *_values(tally, geoid),
        *_modes(tally, sbas),
    )


def _severity(share: float) -> Severity:
    return "error" if share > BAD_SHARE else "warning"


def _damage(tally: Tally, between: Between, size: int) -> Iterator[Finding]:
    good = tally.sentences["all"]
    if between.rejected:
        share = between.rejected / (between.rejected + good)
        yield Finding(
            "E10", _severity(share),
            f"{between.rejected:,} sentences without a good checksum were left out",
            where=f"first at {between.first_rejected}",
            evidence=f"{share:.3%} of {between.rejected + good:,} sentences",
            cure="check the link and the storage; --nmea-checksum optional for a logger that "
            "writes no checksums",
        )  # fmt: skip
    if between.too_long:
        yield Finding(
            "E18", "error", f"{between.too_long:,} sentences are longer than 1,024 characters",
            where=f"first at byte {between.first_too_long:,}",
            evidence="the standard allows 82",
            cure="write the log again with its line ends",
        )  # fmt: skip
    if between.orphan_bytes:
        share = between.orphan_bytes / size
        frames = ", ".join(f"{n:,} {name} frames" for name, n in sorted(between.frames.items()))
        yield Finding(
            "E24", _severity(share), "bytes belong to no sentence and no UBX, SBF or RTCM frame",
            where="first at byte " + ", ".join(f"{at:,}" for at in between.first_orphans),
            evidence=f"{between.orphan_bytes:,} of {size:,} bytes ({share:.3%})"
            + (f"; beside {frames}" if frames else ""),
            cure="check the link and the storage; every intact sentence was read",
        )  # fmt: skip
    if tally.damaged:
        yield Finding(
            "E10", "warning", "epochs have something unreadable in them; flag EPOCH_INCOMPLETE",
            evidence=f"{tally.damaged:,} epochs",
            cure="what is missing in them stays missing",
        )  # fmt: skip
    if unreadable := tally.sentences["unreadable"]:
        yield Finding(
            "E10", _severity(unreadable / max(good, 1)),
            "fields with a good checksum hold no possible value and were taken as missing",
            evidence=f"{unreadable:,} fields",
            cure="look at the receiver's settings",
        )  # fmt: skip
    if tally.unattached:
        yield Finding(
            "E10", "warning", "sentences belong to no epoch and were left out",
            evidence=f"{tally.unattached:,} GSA, GSV, VTG, GST or GBS",
            cure="usual at the start of a log; log GGA or RMC at the same rate",
        )  # fmt: skip


def _time(tally: Tally, span: Span) -> Iterator[Finding]:
    if without := tally.sentences["without time"]:
        yield Finding(
            "E10", "warning", "sentences carry no usable time and were left out",
            evidence=f"{without:,} sentences",
            cure="usual before the first fix; log from when the receiver's clock is set",
        )  # fmt: skip
    if span.rows:
        low, high = np.array([span.low_ns, span.high_ns]).astype("M8[ns]")
        steps = gpst_minus_utc_s(np.array([low, high]))
        yield Finding(
            "E25", "info", f"{span.rows:,} times converted from UTC to GPS time",
            evidence=f"GPST - UTC = {steps[0]} s"
            + (f" to {steps[1]} s" if steps[0] != steps[1] else ""),
            cure="leave out up to 12.5 min after a cold start, until the receiver knows UTC",
        )  # fmt: skip
        if high >= LEAP_TABLE_EXPIRES:
            yield Finding(
                "E25", "warning", "times lie beyond the known end of the leap second table",
                where=f"from {LEAP_TABLE_EXPIRES} UTC", evidence=f"latest {high}",
                cure="update sbas",
            )  # fmt: skip
    if span.inferred:
        yield Finding(
            "E25", "warning", "epochs without a date of their own; flag DATE_INFERRED",
            evidence=f"{span.inferred:,} of {span.rows:,} epochs, counted on over midnight"
            + (" from the date given" if span.given else ""),
            cure="log RMC or ZDA at the same rate; a gap of a day or more cannot be seen",
        )  # fmt: skip
    if span.given and not span.used_given:
        yield Finding(
            "E25", "warning", "the file has dates of its own; the date given was not used",
            evidence=f"given {span.given}",
            cure="leave out --date",
        )  # fmt: skip
    if tally.other_dates:
        yield Finding(
            "E25", "warning", "RMC and ZDA of one epoch tell different dates; ZDA's was kept",
            evidence=f"{tally.other_dates:,} epochs",
            cure="compare with the true date of the record",
        )  # fmt: skip


def _values(tally: Tally, geoid: float | None) -> Iterator[Finding]:
    grave = {name: tally.removed[name] for name in _GRAVE if name in tally.removed}
    yield from sentinel_findings(grave)
    if others := {n: v for n, v in sorted(tally.removed.items()) if n not in _GRAVE}:
        yield Finding(
            "E07", "info", "values that stand for 'missing' were made missing",
            evidence="; ".join(
                f"{name}: {count:,} x {value}"
                for name, values in others.items()
                for value, count in sorted(values.items())
            ),
        )  # fmt: skip
    if tally.invalid_positions:
        yield Finding(
            "E07", "warning", "positions that the receiver declared invalid were made missing",
            evidence=f"{tally.invalid_positions:,} epochs with quality 0 or status V",
        )  # fmt: skip
    if tally.no_separation:
        yield Finding(
            "E25", "warning", "altitudes above the geoid without its separation: no height",
            evidence=f"{tally.no_separation:,} epochs",
            cure="--geoid UNDULATION, the height of the geoid above the ellipsoid there",
        )  # fmt: skip
    if tally.given_separation:
        yield Finding(
            "E26", "info", "altitudes without separation were made ellipsoidal as asked",
            evidence=f"{tally.given_separation:,} epochs, undulation {geoid:g} m",
        )  # fmt: skip
    if tally.differing:
        yield Finding(
            "E06", "warning",
            "sentences of one epoch tell different positions; the first of GGA, GNS, PASHR, "
            "PUBX, RMC was kept",
            evidence=f"{tally.differing:,} epochs, by up to "
            f"{tally.largest_difference_deg * _DEGREE_M:.3g} m in an axis",
            cure="look whether two receivers write into one log",
        )  # fmt: skip
    if tally.more_in_gsa:
        yield Finding(
            "E26", "info", "GGA counts 12 satellites, GSA lists more: the number listed was taken",
            evidence=f"{tally.more_in_gsa:,} epochs",
        )  # fmt: skip
    if tally.other_groups:
        yield Finding(
            "E10", "info", "GSA apart from the first of their epoch were left out",
            evidence=f"{tally.other_groups:,} sentences",
        )  # fmt: skip
    if tally.odd_ellipses:
        yield Finding(
            "E25", "warning", "error ellipses contradict the sigmas beside them: no covariance",
            evidence=f"{tally.odd_ellipses:,} epochs",
        )  # fmt: skip


def _modes(tally: Tally, sbas: bool) -> Iterator[Finding]:
    if tally.contradicted:
        yield Finding(
            "E25", "warning", "RMC warns (status V) beside a fix: counted as no fix",
            evidence=f"{tally.contradicted:,} epochs",
            cure="judge by the receiver's manual what its warning means",
        )  # fmt: skip
    if tally.differential:
        told = "SBAS corrections, as asked" if sbas else "differential, not as SBAS"
        yield Finding(
            "E25", "info", f"NMEA does not tell SBAS from other corrections: counted as {told}",
            evidence=f"{tally.differential:,} epochs with a differential fix",
            cure="" if sbas else "--assume-dgps sbas, where the receiver has no other corrections",
        )  # fmt: skip
