"""Stamps of messages against the GPS time that messages of type 12 state.

Source: RTCA DO-229D, A.4.4.15 (type 12: GPS time of week at the message).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.bit_fields import Bits, unsigned
from sbas.findings import Finding
from sbas.timescales import WEEK_S

Ints = NDArray[np.int64]

LARGEST_OFFSET_S = 2
"""A message lasts 1 s, and sources stamp its start or its end."""


def stamps_against_network_time(
    time_s: Ints, prn: Ints, kind: Ints, bits: Bits
) -> tuple[Finding, ...]:
    """A warning where the stamps of a satellite differ from its own time by a constant above 2 s,
    as stamps in UTC do.

    Parameters
    ----------
    time_s, prn, kind : (n,) stamps, satellites and types of good messages; bits : (n, 256).
    """
    rows = np.flatnonzero(kind == 12)
    tow_s = unsigned(bits[rows], 121, 20)
    rows, tow_s = rows[tow_s < WEEK_S], tow_s[tow_s < WEEK_S]
    offset_s = (time_s[rows] - tow_s + WEEK_S // 2) % WEEK_S - WEEK_S // 2
    found = []
    for satellite in np.unique(prn[rows]).tolist():
        own = offset_s[prn[rows] == satellite]
        least, most = int(own.min()), int(own.max())
        if most - least <= LARGEST_OFFSET_S and min(abs(least), abs(most)) > LARGEST_OFFSET_S:
            found.append(
                Finding(
                    "E02",
                    "warning",
                    f"stamps of PRN {satellite} differ from the GPS time in its messages",
                    evidence=f"{own.size:,} messages of type 12, {least:+d} to {most:+d} s",
                    cure="stamp messages in GPS time; UTC is behind it by the leap seconds",
                )
            )
    return tuple(found)
