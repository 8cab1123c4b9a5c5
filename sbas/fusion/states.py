"""States of a position: N nominal, DA degraded but acceptable, U unacceptable, or no data.

Source: Railways 2014, section 3.1, steps 1 and 2.
"""

from __future__ import annotations

from typing import Final

N: Final = 0
DA: Final = 1
U: Final = 2
NO_DATA: Final = -1
WORDS: Final = {N: "N", DA: "DA", U: "U", NO_DATA: "no data"}
