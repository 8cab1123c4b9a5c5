"""The side table `sbas_frames` from the blocks GEORawL1 and GEORawL5."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import pyarrow as pa

from sbas.logs.septentrio.sbf_decode import prn_of_svid
from sbas.logs.septentrio.sbf_epochs import gps_times
from sbas.logs.septentrio.sbf_parts import Raw
from sbas.logs.septentrio.sbf_plan import FRAMES


def frame_table(raw: Mapping[int, Raw]) -> pd.DataFrame | None:
    """Side table `sbas_frames`, in file order; None where the file has no frame."""
    present = [number for number in FRAMES if number in raw]
    if not present:
        return None
    signal = np.repeat(range(len(present)), [len(raw[n]["position"]) for n in present])
    frames = raw[present[0]]
    if len(present) > 1:
        frames = {name: np.concatenate([raw[n][name] for n in present]) for name in frames}
        order = np.argsort(frames["position"], kind="stable")
        frames, signal = {name: v[order] for name, v in frames.items()}, signal[order]
    # The receiver stores words of 32 bits with the first received bit as the most significant.
    data = pa.py_buffer(frames["bits"].byteswap())
    array = pa.FixedSizeBinaryArray.from_buffers(pa.binary(32), len(signal), [None, data])
    return pd.DataFrame(
        {
            "time": gps_times(frames["time_ms"]),
            "prn": prn_of_svid(frames["svid"]),
            "crc_passed": frames["crc_passed"] != 0,
            "signal": pd.Categorical.from_codes(
                signal.astype(np.int8), categories=[FRAMES[n] for n in present]
            ),
            "frame": pd.arrays.ArrowExtensionArray(pa.chunked_array([array])),
        },
        copy=False,
    )
