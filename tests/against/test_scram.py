"""Static trees against SCRAM, called as a program; skipped where it is not installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from xml.etree.ElementTree import Element, fromstring

import pytest

from sbas.dependability.exchange.open_psa import read_open_psa
from sbas.dependability.exchange.open_psa_export import open_psa_text
from sbas.dependability.static.cut_sets import minimal_cut_sets
from sbas.dependability.static.static_importance import static_importance
from sbas.dependability.static.static_tree import top_probability

pytestmark = pytest.mark.skipif(
    shutil.which("scram") is None, reason="SCRAM is not installed: apt install scram"
)
TREES = ("chinese", "isp9605", "isp9607", "das9202", "das9204", "das9205", "ftr10", "repairable")


def scram(file: Path) -> Element:
    command = ["scram", "--bdd", "--probability", "true", "--importance", "true",
               "--mission-time", "1", str(file)]  # fmt: skip
    report = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    # Their number is compared, not their members, which are most of a report.
    return fromstring(re.sub(r"<product\s.*?</product>", "", report, flags=re.DOTALL))


@pytest.mark.parametrize("name", TREES)
def test_probability_cut_sets_and_importance(reference_data: Path, name: str) -> None:
    """SCRAM prints six digits."""
    file = reference_data / "reference/fault_trees" / f"{name}.xml"
    report = scram(file)
    tree = read_open_psa(file, mission_s=3600).tree
    products = report.find(".//sum-of-products")
    assert products is not None
    theirs = float(products.attrib["probability"])
    assert float(top_probability(tree)) == pytest.approx(theirs, rel=5.1e-6)
    ours = sum(minimal_cut_sets(tree).counts().values())
    assert ours == int(products.attrib["products"])
    rows = {row.event: row for row in static_importance(tree).events}
    compared = 0
    for event in report.iterfind(".//importance/basic-event"):
        row = rows[event.attrib["name"]]
        for key, value in (
            ("MIF", row.birnbaum), ("CIF", row.criticality), ("DIF", row.diagnostic),
            ("RAW", row.raw), ("RRW", row.rrw),
        ):  # fmt: skip
            printed = float(event.attrib[key])
            # Where the top never occurs without the event SCRAM divides by rounding errors.
            if not (key == "RRW" and value > 1e6):
                assert value == pytest.approx(printed, rel=6e-6, abs=1e-12), (row.event, key)
                compared += 1
    assert compared


def test_what_this_package_writes_is_read_there(reference_data: Path, tmp_path: Path) -> None:
    file = reference_data / "reference/fault_trees/chinese.xml"
    written = tmp_path / "chinese.xml"
    written.write_text(open_psa_text(read_open_psa(file).tree).text, encoding="utf-8")
    first, second = (r.find(".//sum-of-products") for r in (scram(file), scram(written)))
    assert first is not None
    assert second is not None
    assert first.attrib["probability"] == second.attrib["probability"]
