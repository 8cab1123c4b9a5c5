"""One drawn figure as an element of a page."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
from matplotlib.figure import Figure

from sbas.plots.style import count_image, house_style
from sbas.reporting.inline_svg import inline_svg


def _svg(key: str, alt: str = "a line") -> str:
    with house_style():
        ax = Figure(figsize=(3, 2)).subplots()
        ax.plot([1, 2, 3], "o-", label="$x$ < 1")
        ax.legend()
        count_image(ax, np.array([[1, 0], [5, 2]]), (0, 1, 0, 1))
    return inline_svg(ax.figure, key=key, alt=alt)


def test_ids_of_two_pictures_do_not_meet() -> None:
    ids = [set(re.findall(r' id="([^"]+)"', _svg(key))) for key in ("a", "b")]
    assert ids[0]
    assert not ids[0] & ids[1]
    assert _svg("a") == _svg("a")


def test_is_well_formed_scalable_and_escaped() -> None:
    root = ET.fromstring(_svg("a", alt='5 < 6 & "so"'))
    assert root.tag == "svg"
    assert root.get("viewBox") == "0 0 216 144"
    assert root.get("width") is None
    assert root.get("aria-label") == '5 < 6 & "so"'
    texts = [node.text for node in root.iter("text")]
    assert "$x$ < 1" in texts


def test_counts_are_one_embedded_image_each_not_a_path_a_cell() -> None:
    images = list(ET.fromstring(_svg("a")).iter("image"))
    assert images
    assert all(str(image.get("href")).startswith("data:image/png;base64,") for image in images)
