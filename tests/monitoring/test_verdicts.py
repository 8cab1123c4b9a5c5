from __future__ import annotations

from sbas.monitoring.normal_equations import GeometryReason
from sbas.monitoring.verdicts import MonitorReason, Verdict


def test_every_verdict_and_reason_has_words_of_its_own() -> None:
    for kind in (Verdict, MonitorReason):
        words = [member.words for member in kind]
        assert len(set(words)) == len(words)
    assert [r.words for r in MonitorReason if not r.words] == [""]


def test_reasons_of_the_geometry_keep_their_numbers() -> None:
    for reason in GeometryReason:
        assert MonitorReason(reason).words == reason.words
