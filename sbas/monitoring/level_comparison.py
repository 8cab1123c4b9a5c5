"""RAIM beside SBAS on the same epochs: the paper's Fig. 5, and a comparison that is fair.

HERL is the effect of the smallest fault found with a stated probability, HPL a bound with a stated
risk: they are unlike quantities. A level of solution separation with the HPL's own risk is like
it. Source: Filip, Bazant, Mocek 2010, section 4 and Fig. 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.monitoring.detection_constants import upper_tail
from sbas.monitoring.normal_equations import Floats
from sbas.monitoring.raim_result import RaimResult
from sbas.monitoring.recorded_ranges import Sigma
from sbas.monitoring.recording_monitor import raim, takes_ranges
from sbas.monitoring.separation import SeparationBudget
from sbas.monitoring.verdicts import Verdict
from sbas.recording import Recording, with_columns

K_H_PA, K_H_NPA = 6.0, 6.18
"""Published horizontal factors of precision and non-precision approach."""


@dataclass(frozen=True, eq=False, repr=False)
class LevelComparison:
    """RAIM and SBAS on the same epochs.

    Parameters
    ----------
    levels : by time: `hpl_m`, `herl_m` (NaN where RAIM is not available: a gap, not 0; infinite
        where that is because a fault would not show), `hdop`, `n_sv` ranges, `like_hpl_m` the
        level of solution separation with the risk of the HPL, `hpl_slope_m`, `sigma_major_m`,
        `available`. `like_hpl_m` and `sigma_major_m` are absent where the levels are the
        recording's own.
    risk : of the HPL, which `like_hpl_m` shares; None without `like_hpl_m`.
    by_satellites : by number of ranges, -1 where it is not known: epochs, `fix`, `tested`,
        `identifies`, `available`.
    both : 2 x 2 epochs: rows SBAS available no, yes; columns RAIM available no, yes. RAIM is
        available with `like_hpl_m` below the alert limit; without that level, where the verdict
        passed: HERL is no bound to hold against a limit.
    """

    levels: pd.DataFrame
    raim: RaimResult
    risk: float | None
    by_satellites: pd.DataFrame
    both: NDArray[np.int64]
    alert_limit_m: float | None

    def ratio(self, name: str) -> Floats:
        """Ratios of a level to the HPL, where both are finite and above 0 and RAIM is available."""
        level, hpl = self.levels[name].to_numpy(), self.levels["hpl_m"].to_numpy()
        known = self.levels["available"].to_numpy() & (level > 0) & (hpl > 0)
        known &= np.isfinite(level) & np.isfinite(hpl)
        ratio: Floats = level[known] / hpl[known]
        return ratio[np.isfinite(ratio) & (ratio > 0)]

    @property
    def raim_words(self) -> str:
        """What makes RAIM available in `both`."""
        if self.risk is None:
            return "its verdict passed; HERL is no bound to hold against a limit"
        if self.alert_limit_m is None:
            return "its level with the risk of the HPL is finite"
        return f"its level with the risk of the HPL lies below {self.alert_limit_m:g} m"

    @property
    def herl_is_usually_larger(self) -> bool | None:
        """The paper's statement on these epochs: True above one half; None where there is none."""
        ratio = self.ratio("herl_m")
        return bool((ratio > 1).mean() > 0.5) if ratio.size else None

    @property
    def even_shift(self) -> float | None:
        """The delta0 with which HERL would be larger than HPL at half of the epochs.

        HERL is proportional to delta0, which is a setting of the receiver: the paper's statement
        holds above this value and fails below. None where the settings behind HERL are not known.
        """
        ratio = self.ratio("herl_m")
        if self.raim.design is None or not ratio.size:
            return None
        return float(self.raim.design.shift / np.median(ratio))

    @property
    def herl_hdop_correlation(self) -> float | None:
        """Rank correlation of HERL and HDOP; None where one of them does not vary."""
        rows = self.levels["available"].to_numpy()
        pair = self.levels.loc[rows, ["herl_m", "hdop"]]
        pair = pair[np.isfinite(pair).all(axis=1)].rank()
        if len(pair) < 3 or (pair.std() == 0).any():
            return None
        return float(np.corrcoef(pair["herl_m"], pair["hdop"])[0, 1])

    def statement(self) -> str:
        """What the figures say of the paper's statement, in words with the figures."""
        ratio = self.ratio("herl_m")
        if not ratio.size:
            return "No epoch has both a HERL and an HPL: the statement cannot be judged."
        larger = int((ratio > 1).sum())
        verdict = "holds" if self.herl_is_usually_larger else "does not hold"
        text = (
            f"HERL is larger than HPL at {larger:,} of {ratio.size:,} epochs with both "
            f"({100 * larger / ratio.size:.1f} %), median ratio {np.median(ratio):.2f}: 'HERL "
            f"usually larger than HPL' {verdict} here. "
        )
        if self.raim.design is not None:
            text += (
                f"HERL is the effect of the smallest fault that the test of a range finds "
                f"(false alarm {self.raim.design.outlier_alarm:g}, missed detection "
                f"{self.raim.design.missed_detection:g}: delta0 {self.raim.design.shift:.2f}), "
                f"not a bound; with delta0 below {self.even_shift:.2f} the statement would not "
                f"hold. "
            )
        else:
            text += "The probabilities behind HERL are not known; HERL is not a bound. "
        correlation = self.herl_hdop_correlation
        if correlation is not None:
            text += f"Rank correlation of HERL and HDOP: {correlation:.2f}. "
        if self.risk is not None:
            like = self.ratio("like_hpl_m")
            text += (
                f"With the HPL's own risk of {self.risk:.3g} per epoch the level of RAIM is "
                f"larger at {100 * (like > 1).mean():.1f} % of {like.size:,} epochs, median "
                f"ratio {np.median(like):.2f}."
                if like.size
                else "No level with the HPL's own risk exists."
            )
        return text.strip()

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        ratios = {}
        for name in ("herl_m", "hpl_slope_m", "like_hpl_m"):
            if name in self.levels.columns:
                ratio = self.ratio(name)
                ratios[name.removesuffix("_m")] = {
                    "epochs": int(ratio.size),
                    "larger": int((ratio > 1).sum()),
                    "median_ratio": float(np.median(ratio)) if ratio.size else None,
                }
        return {
            "epochs": len(self.levels),
            "over_hpl": ratios,
            "herl_is_usually_larger": self.herl_is_usually_larger,
            "source": self.raim.source,
            "delta0": None if self.raim.design is None else self.raim.design.shift,
            "delta0_of_equal_levels": self.even_shift,
            "herl_hdop_correlation": self.herl_hdop_correlation,
            "risk": self.risk,
            "alert_limit_m": self.alert_limit_m,
            "sbas_and_raim": {
                "neither": int(self.both[0, 0]),
                "raim_only": int(self.both[0, 1]),
                "sbas_only": int(self.both[1, 0]),
                "both": int(self.both[1, 1]),
            },
            "raim_available_where": self.raim_words,
            "by_satellites": {
                str(n) if int(str(n)) >= 0 else "unknown": {name: int(v) for name, v in row.items()}
                for n, row in self.by_satellites.to_dict("index").items()
            },
            "statement": self.statement(),
            "findings": [f.to_dict() for f in self.raim.findings],
        }

    def __repr__(self) -> str:
        return f"{self.statement()}\n{self.by_satellites}"


def hpl_risk(k_h: float) -> float:
    """Risk per sample that a horizontal factor stands for.

    The factor 6.0 of a precision approach is of one axis, both tails: 2 Q(6) = 2e-9; that of a
    non-precision approach of a circular error: exp(-K^2 / 2), 5e-9 with 6.18. Source: Filip,
    Bazant, Mocek 2010, section 2.1.
    """
    if not 0 < k_h < math.inf:
        raise InputError("a horizontal factor is a number above 0", evidence=f"{k_h}")
    return 2 * upper_tail(k_h) if k_h == K_H_PA else math.exp(-(k_h**2) / 2)


def raim_against_sbas(
    recording: Recording,
    *,
    risk: float | None = None,
    prior: float = 1e-5,
    false_alarm: float = 1e-3,
    missed_detection: float = 1e-4,
    outlier_alarm: float = 1e-4,
    sigma: Sigma = None,
    elevation_mask_deg: float | None = None,
    alert_limit_m: float | None = None,
) -> LevelComparison:
    """Levels of RAIM and SBAS on the epochs of one recording.

    Parameters
    ----------
    recording : with `hpl_m`, and with ranges or the receiver's own HERL.
    risk : of the HPL, per sample; None takes that of the recording's horizontal factor.
    prior, false_alarm, missed_detection, outlier_alarm, sigma, elevation_mask_deg : see `raim`.
    alert_limit_m : where given, a service is available only with its level below it; RAIM that
        the recording has without ranges is available by its verdict alone.

    Raises
    ------
    InputError : no HPL, a factor that is not known and no risk, or settings of levels from ranges
        for a recording without them.
    """
    if "hpl_m" not in recording.columns:
        raise InputError("the recording has no HPL to compare with", cure="sbas protect")
    if alert_limit_m is not None and not 0 < alert_limit_m < math.inf:
        raise InputError("an alert limit is a number above 0 [m]", evidence=f"{alert_limit_m}")
    if takes_ranges(recording, sigma) or "herl_m" not in recording.columns:
        risk = _risk_of(recording) if risk is None else risk
    elif risk is not None:
        raise InputError(
            "a risk is of levels from ranges: the recording has HERL alone, which has none",
            where="risk", cure="leave it out, or give a recording with ranges: sbas protect",
        )  # fmt: skip
    result = raim(
        recording, false_alarm=false_alarm, missed_detection=missed_detection,
        outlier_alarm=outlier_alarm, risk=SeparationBudget.risk if risk is None else risk,
        prior=prior, sigma=sigma, elevation_mask_deg=elevation_mask_deg,
    )  # fmt: skip
    epochs = result.epochs
    given = with_columns(recording.table, ("hpl_m", "hdop"))
    levels = pd.DataFrame({name: given[name].to_numpy() for name in given}, index=epochs.index)
    available = epochs["available"].to_numpy()
    levels["available"] = available
    levels["n_sv"] = epochs["n_sv"].to_numpy()
    for name, own in (
        ("herl_m", "herl_m"),
        ("hpl_slope_m", "hpl_slope_m"),
        ("like_hpl_m", "hpl_separation_m"),
        ("sigma_major_m", "sigma_major_m"),
    ):
        if own in epochs.columns:
            values = epochs[own].to_numpy()
            levels[name] = np.where(available | np.isinf(values), values, np.nan)
    limit = math.inf if alert_limit_m is None else alert_limit_m
    hpl = levels["hpl_m"].to_numpy()
    with_sbas = (hpl > 0) & (hpl < limit)
    with_raim = available
    if risk is not None:
        with_raim = available & (levels["like_hpl_m"].to_numpy() < limit)
    both = np.zeros((2, 2), np.int64)
    np.add.at(both, (with_sbas.astype(int), with_raim.astype(int)), 1)
    return LevelComparison(
        levels, result, risk, availability_by_satellites(result), both, alert_limit_m
    )


def availability_by_satellites(result: RaimResult) -> pd.DataFrame:
    """Epochs by number of ranges: all, with a fix, tested, able to identify, available.

    The number is -1 where an epoch's ranges are not known to be those of its fix. Of RAIM that
    the recording has without ranges only `epochs` and `available` are known.
    """
    epochs = result.epochs
    data = pd.DataFrame({"n_sv": epochs["n_sv"].to_numpy(), "epochs": 1})
    if "dof" in epochs.columns:
        # A geometry that is degenerate has ranges enough, and yet no sigma.
        fix = np.isfinite(epochs["sigma_major_m"].to_numpy())
        dof = epochs["dof"].to_numpy()
        data["fix"] = fix
        data["tested"] = fix & (dof >= 1) & np.isfinite(epochs["statistic"].to_numpy())
        data["identifies"] = data["tested"] & (dof >= 2)
        data["passed"] = (epochs["verdict"] == Verdict.PASSED.words).to_numpy()
    data["available"] = epochs["available"].to_numpy()
    return data.groupby("n_sv").sum().astype(np.int64)


def _risk_of(recording: Recording) -> float:
    """Risk of the recording's own levels; of several modes the smaller one, which RAIM then has
    to keep everywhere."""
    meta = recording.meta.pl
    if meta.k_h is not None:
        return hpl_risk(meta.k_h)
    if meta.kind == "do229" and "mode" in recording.columns:
        modes = set(recording.table["mode"].cat.categories[recording.table["mode"].cat.codes])
        factors = [k for mode, k in (("sbas_pa", K_H_PA), ("sbas_npa", K_H_NPA)) if mode in modes]
        if factors:
            return min(map(hpl_risk, factors))
    raise InputError(
        "the risk of the recording's levels is not known",
        evidence=f"kind {meta.kind}, no horizontal factor",
        cure="risk=2e-9 for precision approach, 5e-9 for non-precision approach",
    )
