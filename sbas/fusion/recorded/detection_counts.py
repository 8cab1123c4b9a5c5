"""What a protection level was worth: epochs of a recording by true state and declaration."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd


@dataclass(frozen=True)
class DetectionCounts:
    """Epochs by true state and declaration; usable is declared where HPL < alert limit.

    Parameters
    ----------
    safe, available, hazard : N, DA and U declared usable; the hazard is HMI.
    false_alarm_n, false_alarm_da, detected : N, DA and U whose level reaches the alert limit.
    misleading : of the usable ones, HPL <= error < alert limit: misleading without hazard.
    no_level_n, no_level_da, no_level_u : positions without a level of the service, which neither
        declare nor detect anything.
    raim_failed, raim_failed_u : epochs whose fault RAIM found, and how many of them had an error
        of the alert limit or more; no data, as for `sbas.receiver_states`.
    no_data : epochs at which the sensor gave nothing, `raim_failed` included.
    unknown : epochs of which the record does not tell the state; see `RecordedErrors`.
    """

    safe: int
    available: int
    hazard: int
    false_alarm_n: int
    false_alarm_da: int
    detected: int
    misleading: int
    no_level_n: int
    no_level_da: int
    no_level_u: int
    raim_failed: int
    raim_failed_u: int
    no_data: int
    unknown: int

    @property
    def judged(self) -> int:
        """Epochs with a state N, DA or U."""
        return self.acceptable + self.unacceptable

    @property
    def acceptable(self) -> int:
        """Epochs N or DA, declared usable or not: available in the words of Railways 2014."""
        false_alarms = self.false_alarm_n + self.false_alarm_da
        return self.safe + self.available + false_alarms + self.no_level_n + self.no_level_da

    @property
    def unacceptable(self) -> int:
        """Epochs U, declared usable or not."""
        return self.hazard + self.detected + self.no_level_u

    def to_dict(self) -> dict[str, int]:
        """Plain values for JSON."""
        return dict(vars(self))

    def summary(self) -> pd.DataFrame:
        """A row a state, a column a declaration [epochs]."""
        return pd.DataFrame(
            {
                "usable": [self.safe, self.available, self.hazard],
                "not_usable": [self.false_alarm_n, self.false_alarm_da, self.detected],
                "no_level": [self.no_level_n, self.no_level_da, self.no_level_u],
            },
            index=pd.Index(["N", "DA", "U"], name="state"),
        )
