"""Reference frames by name, and named transformations between them.

Names, codes, parameters and accuracies are those of the EPSG data set that comes with PROJ; no
grid is fetched, and no transformation of unknown accuracy is used. As text:

    ETRF2000 2025.5                                a frame, and the epoch of coordinates in it
    ETRF2000>ITRF2014@2025.5                       a change of frame at an epoch
    EPSG:5514>ETRS89>ITRF2014@2025.5               through another frame
    S-JTSK>ETRS89[S-JTSK to ETRS89 (3)]            by an operation of that name
    ITRF2014 2010.0>ETRF2014>ITRF2014@2025.5       to another epoch, at rest on the plate
"""

from sbas.frames.frame_doubts import frame_doubts
from sbas.frames.named_frames import Frame, FrameChange, find_frame, frame_change
from sbas.frames.transformation import Changed, change_frame, decimal_year, unprojected

__all__ = [
    "Changed",
    "Frame",
    "FrameChange",
    "change_frame",
    "decimal_year",
    "find_frame",
    "frame_change",
    "frame_doubts",
    "unprojected",
]
