"""Parquet: of the package, and of another program. A table has no pieces."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from sbas.logs.arrow import parquet_writer
from sbas.recording import Recording
from tests.corruption.forms import Form, Pieces

_FOREIGN = {"lat_deg": "lat", "lon_deg": "lon", "height_m": "height", "hpl_m": "hpl",
            "vpl_m": "vpl"}  # fmt: skip


def _own(recording: Recording) -> Pieces:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "made.parquet"
        parquet_writer.write([recording], path)
        return Pieces(path.read_bytes(), ())


def _foreign(recording: Recording) -> Pieces:
    table = recording.table.rename(columns=_FOREIGN).reset_index()
    if "mode" in table:
        table["mode"] = table["mode"].astype(str)
    out = io.BytesIO()
    pq.write_table(pa.Table.from_pandas(table, preserve_index=False), out)
    return Pieces(out.getvalue(), ())


TABLE_FORMS = (
    Form("parquet", "parquet", ".parquet", "table", _own, numbers=True),
    Form("parquet foreign", "parquet", ".parquet", "table", _foreign, numbers=True,
         options={"time_scale": "GPST"}),
)  # fmt: skip
