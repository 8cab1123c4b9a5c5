"""Can this recording be trusted? Findings with their cures, and the repairs they name."""

from __future__ import annotations

from sbas.input_check.checking import ACCEPTABLE, CheckResult, accept, check
from sbas.input_check.fixing import fix
from sbas.input_check.repairs import Repairs, repair

__all__ = ["ACCEPTABLE", "CheckResult", "Repairs", "accept", "check", "fix", "repair"]
