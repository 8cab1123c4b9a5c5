"""Reference frames by name, as the EPSG data set of PROJ has them, and chains of them."""

from __future__ import annotations

import difflib
import functools
import re
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

from sbas.exceptions import InputError

_EPOCH = re.compile(r"(.*?)(?:\s*@\s*|\s+)(\d{4}(?:\.\d+)?)")


@dataclass(frozen=True)
class Frame:
    """A frame of the EPSG data set: geographic, with heights where the data set has them.

    Parameters
    ----------
    name : as EPSG spells it.
    code : EPSG code of the geographic frame (three-dimensional where there is one).
    dynamic : points on the ground move in it, so that coordinates need an epoch.
    ensemble : several realisations share the name.
    ellipsoid : name.
    epoch : decimal year of the coordinates; None where not stated.
    projection : EPSG code of the projected coordinates that the frame was named by, if any.
    """

    name: str
    code: int
    dynamic: bool
    ensemble: bool
    ellipsoid: str
    epoch: float | None = None
    projection: int | None = None

    def __str__(self) -> str:
        return self.name if self.epoch is None else f"{self.name} {self.epoch:.8g}"

    @property
    def is_wgs84_ensemble(self) -> bool:
        return self.ensemble and self.name == "WGS 84"


class Step(NamedTuple):
    """One change of frame: where it leads, and the words that name its operation."""

    target: Frame
    operation: str


@dataclass(frozen=True)
class FrameChange:
    """A chain of named changes of frame; see the head of this file for its text."""

    source: Frame
    steps: tuple[Step, ...]


def _key(name: str) -> str:
    return re.sub(r"[^a-z0-9+]", "", name.casefold())


@functools.cache
def _names() -> dict[str, tuple[str, int]]:
    """EPSG name and code of each geographic frame by its squeezed name, 3D before 2D."""
    from pyproj.database import query_crs_info
    from pyproj.enums import PJType

    found = {}
    for kind in (PJType.GEOGRAPHIC_2D_CRS, PJType.GEOGRAPHIC_3D_CRS):
        for info in query_crs_info(auth_name="EPSG", pj_types=[kind]):
            found[_key(info.name)] = (info.name, int(info.code))
    return found


def find_frame(text: str) -> Frame:
    """The frame that a text names: `ETRF2000`, `ITRF2014 2010.0`, `EPSG:25833`.

    What follows a comma is a remark. Case, blanks and hyphens do not matter.

    Raises
    ------
    InputError : a name that EPSG does not know, with near ones; coordinates that are neither
        geographic nor easting and northing in metres.
    """
    words = text.partition(",")[0].strip()
    epoch = None
    if _key(words) not in _names() and (parted := _EPOCH.fullmatch(words)):
        words, epoch = parted[1].strip(), float(parted[2])
        if not 1980 <= epoch < 2100:
            raise InputError(
                "the epoch of a frame is a decimal year",
                evidence=repr(text),
                cure="ETRF2000 2025.5",
            )
    if code := re.fullmatch(r"epsg:\s*(\d{1,6})", words, re.IGNORECASE):
        return replace(_frame_of_code(int(code[1])), epoch=epoch)
    if (known := _names().get(_key(words))) is None:
        near = difflib.get_close_matches(_key(words), _names(), n=5, cutoff=0.6)
        raise InputError(
            f"unknown reference frame {words!r}",
            evidence=f"near: {', '.join(_names()[key][0] for key in near) or 'none'}",
            cure="name it as EPSG does, such as ETRF2000, ITRF2014, 'WGS 84 (G2139)', EPSG:25833",
        )
    return replace(_frame_of_code(known[1]), epoch=epoch)


@functools.cache
def _frame_of_code(code: int) -> Frame:
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        crs = CRS.from_epsg(code)
    except CRSError:
        raise InputError(
            f"EPSG has no coordinates of code {code}", cure="name the frame, such as ETRF2000"
        ) from None
    projected = crs.is_projected and len(crs.axis_info) == 2
    if projected:
        axes = {axis.direction for axis in crs.axis_info}
        if axes != {"east", "north"} or {axis.unit_name for axis in crs.axis_info} != {"metre"}:
            raise InputError(
                f"EPSG:{code} ({crs.name}) is not easting and northing in metres",
                evidence=", ".join(f"{a.direction} in {a.unit_name}" for a in crs.axis_info),
                cure="use the variant with axes east and north, such as EPSG:5514 for Krovak",
            )
    elif crs.type_name not in ("Geographic 2D CRS", "Geographic 3D CRS"):
        raise InputError(
            f"EPSG:{code} ({crs.name}) is a {crs.type_name}",
            cure="name a geographic frame, or projected coordinates without a height system",
        )
    base = crs.geodetic_crs if projected else crs
    assert base is not None
    name, own = _names().get(_key(base.name), (base.name, code))
    datum = CRS.from_epsg(own).datum
    assert datum is not None
    return Frame(
        name,
        own,
        dynamic=datum.type_name.startswith("Dynamic"),
        ensemble=datum.type_name == "Datum Ensemble",
        ellipsoid=base.ellipsoid.name if base.ellipsoid else "",
        projection=code if projected else None,
    )


def frame_change(text: str) -> FrameChange:
    """The changes of frame that a text such as `ETRF2000>ITRF2014@2025.5` names.

    Raises
    ------
    InputError : fewer than two frames, one that is not known, or a step that leads nowhere.
    """
    cure = "--truth-transform 'ETRF2000>ITRF2014@2025.5'"
    words = text.split(">")
    if len(words) < 2 or not all(word.strip() for word in words):
        raise InputError("a change of frame names two frames", evidence=repr(text), cure=cure)
    parted = [re.fullmatch(r"([^\[\]]*)(?:\[([^\[\]]+)\])?\s*", word) for word in words]
    matched = [part for part in parted if part is not None]
    if len(matched) < len(words) or matched[0][2]:
        raise InputError(
            "an operation stands in brackets behind the frame that it leads to",
            evidence=repr(text),
            cure="S-JTSK>ETRS89[S-JTSK to ETRS89 (3)]",
        )
    frames = [find_frame(part[1]) for part in matched]
    operations = [(part[2] or "").strip() for part in matched]
    for before, after in pairwise(frames):
        if before.code == after.code:
            raise InputError(
                f"a change from {before.name} to itself changes nothing",
                evidence="to move coordinates to another epoch, name a frame fixed to the plate",
                cure="'ITRF2014 2010.0>ETRF2014>ITRF2014@2025.5'",
            )
        if after.projection is not None:
            raise InputError(
                "a change of frame leads to latitude and longitude",
                evidence=f"EPSG:{after.projection}",
                cure=f"name {after.name}",
            )
    return FrameChange(frames[0], tuple(map(Step, frames, operations))[1:])
