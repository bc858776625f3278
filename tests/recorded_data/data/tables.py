"""Writes pyarrow.parquet and polars.parquet: u(k) = 7 k^2 mod 11, y(k) = 5 k^2 mod 11 for k = 0 ... 59 and a column of
texts, as other programs encode them. Run with pyarrow and polars installed."""

import pathlib

import polars
import pyarrow
import pyarrow.parquet

here = pathlib.Path(__file__).parent
columns = {
    "u": [float(7 * k * k % 11) for k in range(60)],
    "y": [5 * k * k % 11 for k in range(60)],
    "note": ["even" if k % 2 == 0 else None for k in range(60)],
}
# Dictionaries, pages of the second version, four groups of rows.
pyarrow.parquet.write_table(
    pyarrow.table(columns), here / "pyarrow.parquet", compression="snappy", data_page_version="2.0", row_group_size=17
)
polars.DataFrame(columns).write_parquet(here / "polars.parquet", compression="gzip", row_group_size=17)
