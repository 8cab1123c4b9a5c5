"""How long errors stay correlated, and which K factor that needs."""

from __future__ import annotations

from sbas.estimate import Estimate, Refusal
from sbas.integrity.correlation.decorrelation_results import DEFINITIONS, MISFITS, Decorrelation
from sbas.integrity.exposure.exposure_models import MODELS, PUBLISHED_K
from sbas.integrity.exposure.k_against_tau import k_against_tau
from sbas.integrity.exposure.k_verdicts import KVerdict
from sbas.integrity.railway_judgement import HOUR_S, RAILWAY_RISK_PER_H, RailwayJudgement
from sbas.integrity.results import Evaluation
from sbas.numerals import count, number, share, upward
from sbas.plots import autocorrelation_picture, k_against_tau_picture
from sbas.reporting.content import Callout, Cell, Section, Table, table
from sbas.reporting.drawn import drawn


def section(evaluation: Evaluation) -> Section:
    """Decorrelation time with its interval, its other definitions, and the verdict on 6.18."""
    found = evaluation.process.decorrelation
    judged = evaluation.railway
    # The target of the curve does not hang on the record: it is drawn without a tau, too.
    target = judged.risk_per_h if isinstance(judged, RailwayJudgement) else RAILWAY_RISK_PER_H
    tables = [_definitions(found)] if found.definitions else []
    if isinstance(judged, RailwayJudgement):
        tables += [_k_factors(judged), _verdicts(judged), _availability(judged)]
    return Section(
        "decorrelation",
        "Decorrelation time and K factor",
        callouts=(_answer(found, judged),),
        tables=tuple(tables),
        pictures=(
            drawn(
                "acf", "Autocorrelation of the errors", autocorrelation_picture.SHEET,
                lambda axes: autocorrelation_picture.decorrelation_curve(found, ax=axes[0]),
                "Autocorrelation of east and north errors against lag, with the fitted process.",
                "Where the curve falls to 1/e is the decorrelation time; the band is the sampling "
                "error of such a record. The published K supposes 360 s.",
            ),
            drawn(
                "k-against-tau", "K factor against decorrelation time",
                k_against_tau_picture.SHEET,
                lambda axes: k_against_tau_picture.k_curve(
                    k_against_tau(target), decorrelation=found,
                    ax=axes[0],
                ),
                "K factor that the railway target needs, against the decorrelation time, under "
                "each process model, with the published 6.18.",
                f"For {number(target)} per hour. The models part because the 1/e time alone does "
                "not say how often a high level is reached anew; white noise raises K further, "
                "see the table.",
            ),
        ),
    )  # fmt: skip


def _answer(found: Decorrelation, judged: RailwayJudgement | Refusal) -> Callout:
    lines = [f"{found.verdict_text[0].upper()}{found.verdict_text[1:]}."]
    if isinstance(found.tau_s, Estimate):
        lines.insert(
            0,
            f"The errors decorrelate in {number(found.tau_s.value)} s ({found.interval_text}, "
            f"{found.tau_s.evidence}): {MISFITS[found.misfit or 'gm1']}.",
        )
    if isinstance(judged, Refusal):
        lines.append(f"Whether K = {PUBLISHED_K:g} is enough cannot be told: {judged}.")
        return Callout("warning", "K factor not judged", tuple(lines))
    lines.append(
        "If errors measured as here had just the sigma that the levels claim (HPL/K): "
        f"{judged.as_claimed.verdict}"
    )
    seen = judged.as_seen
    lines.append(
        f"With the sigma of these errors, {number(seen.sigma_ratio)} of what the levels claim: "
        f"{seen.verdict}"
        if isinstance(seen, KVerdict)
        else f"With the sigma of these errors: not given, {seen}."
    )
    enough = all(r.verdict == "enough" for r in judged.as_claimed.risks.values())
    title = f"K = {PUBLISHED_K:g} for {number(judged.risk_per_h)} per hour"
    return Callout("good" if enough else "warning", title, tuple(lines))


def _definitions(found: Decorrelation) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (Cell(key.removesuffix("_s").replace("_", " ")),
         "not reached" if seconds is None else number(seconds), DEFINITIONS[key])
        for key, seconds in (found.definitions or {}).items()
    ]  # fmt: skip
    return table(
        "Other times that are called decorrelation time [s]",
        "Definition|#Time [s]|Meaning",
        rows,
        f"From {count(found.samples)} epochs; {count(found.clipped)} clipped as outliers. White "
        f"share of the variance at one step: at most {upward(found.white_share)}. The times are "
        "not interchangeable: only the median-unbiased 1/e time above carries an interval.",
    )


def _k_factors(judged: RailwayJudgement) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (Cell(name, trace="k-models"), f"{model.k:.4f}", number(model.n_es),
         upward(model.hourly_risk_of_6_18), MODELS[name][1])
        for name, model in judged.models.models.items()
    ]  # fmt: skip
    return table(
        f"K factor for {number(judged.risk_per_h)} per hour at the measured time (modelled)",
        "Process|#K|#Effective samples in the hour|#Hourly risk of 6.18|Errors are",
        rows,
        *(f"{caveat[0].upper()}{caveat[1:]}." for caveat in judged.models.caveats),
    )


def _verdicts(judged: RailwayJudgement) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    cases = (("as the levels claim", judged.as_claimed), ("as these errors had", judged.as_seen))
    for words, verdict in cases:
        if isinstance(verdict, Refusal):
            continue
        for name, risk in verdict.risks.items():
            tone = {"enough": "good", "not enough": "bad", "undecided": "warning"}[risk.verdict]
            rows.append(
                (words, Cell(name, trace="k-verdict"), upward(risk.point),
                 upward(risk.upper_sigma), upward(risk.upper_sigma_lower_tau),
                 upward(risk.lower_sigma_upper_tau),
                 Cell(risk.verdict, tone))  # type: ignore[arg-type]
            )  # fmt: skip
    claimed = judged.as_claimed
    return table(
        f"Risk of K = {PUBLISHED_K:g} over {HOUR_S:g} s, with the intervals of sigma and tau",
        "Sigma|Process|#At the estimates|#Upper sigma|#Upper sigma, lower tau (worst)|"
        "#Lower sigma, upper tau (best)|Verdict",
        rows,
        f"Target {number(judged.risk_per_h)} per hour. Tau from {number(claimed.tau_lower_s)} to "
        f"{number(claimed.tau_upper_s)} s; sigma from {number(claimed.sigma.lower)} to "
        f"{number(claimed.sigma.upper)} of its estimate (of one axis alone wider), each bound at "
        f"{100 * claimed.confidence:g} %. Gaussian errors.",
    )


def _availability(judged: RailwayJudgement) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (f"{limit:g}", share(recorded), share(railway))
        for limit, (recorded, railway) in judged.availability.items()
    ]
    return table(
        "Availability with a railway HPL (share of epochs, gaps left out)",
        "#Alert limit [m]|#HPL as recorded|#Railway HPL",
        rows,
        f"Railway HPL: every level re-scaled to K = {judged.k:.4f}, which holds "
        f"{number(judged.risk_per_h)} per hour at the lower limit of the decorrelation time for "
        "sampled Gauss-Markov errors with the white share of this record.",
    )
