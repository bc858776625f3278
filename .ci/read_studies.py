"""Reads a study's Parquet files with pandas and with DuckDB, and compares both with summary.json: columns, types,
nulls, row counts, figures. Usage: read_studies.py DIR..."""

import json
import sys
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import pyarrow.parquet

# Apache Arrow's types and DuckDB's.
TYPES = {
    "string_view": "VARCHAR",
    "double": "DOUBLE",
    "int32": "INTEGER",
    "int64": "BIGINT",
    "bool": "BOOLEAN",
}
ESTIMATES = ["mean", "sd", "mse", "rmse", "trimmed", "q05", "q25", "q50", "q75", "q95"]
FAILING = ["e_a", "e_b", "e_h", "e_x0", "e_x_max", "e_x_rms"]


def both(path: Path) -> pd.DataFrame:
    """The file by pandas, when DuckDB sees the same: columns, types, rows, nulls, sums."""
    frame = pd.read_parquet(path)
    duck = duckdb.connect()
    source = f"read_parquet('{path}')"
    described = dict(duck.execute(f"select column_name, column_type from (describe select * from {source})").fetchall())
    schema = pyarrow.parquet.read_schema(path)
    assert described == {field.name: TYPES[str(field.type)] for field in schema}, (described, schema)
    assert list(frame.columns) == schema.names
    for name in frame.columns:
        quoted = f'"{name}"'
        rows, present = duck.execute(f"select count(*), count({quoted}) from {source}").fetchall()[0]
        assert rows == len(frame), (name, rows, len(frame))
        assert present == frame[name].notna().sum(), (name, present)
        if described[name] == "DOUBLE" and present:
            select = f"select min({quoted}), median({quoted}), max({quoted}) from {source}"
            low, middle, high = duck.execute(select).fetchall()[0]
            there = frame[name].dropna()
            assert (low, high) == (there.min(), there.max()), name
            assert np.isclose(middle, there.median(), rtol=1e-12, atol=0), name
    return frame


def check_summary(frame: pd.DataFrame, summary: dict) -> None:
    """A row for each figure of each output of each cell, with the numbers of summary.json (nine digits there)."""
    rows = iter(frame.to_dict("records"))
    for cell in summary["cells"]:
        for output in cell["outputs"]:
            parameters = [(f"error of {name}", of) for name, of in output.get("parameters", [])]
            for figure, of in [*output["figures"].items(), *parameters]:
                row = next(rows)
                place = (cell["cell"], output["estimator"], output["pass"], figure)
                assert (row["cell"], row["estimator"], row["pass"], row["measure"]) == place, (row, place)
                outcomes = output["outcomes"]
                assert row["trials"] == cell["trials"] == outcomes["trials"], place
                assert row["unstable"] == outcomes["unstable"], place
                assert row["failed"] == sum(count for count in outcomes["failures"].values()), place
                assert row["count"] == of["count"] <= row["trials"], place
                for name in ESTIMATES:
                    for key, column in (("value", name), ("mcse", f"{name}_mcse")):
                        expected = of[name][key]
                        if expected is None:
                            assert not np.isfinite(row[column]), (place, column)
                        else:
                            assert np.isclose(row[column], float(expected), rtol=1e-8, atol=0), (place, column)
    assert next(rows, None) is None, "rows that summary.json does not have"


def check_trials(frame: pd.DataFrame, summary: dict) -> None:
    """A row for each output of each trial; no figure without a status 'ok'; the summary counts the same."""
    outputs = [(output["estimator"], output["pass"]) for output in summary["cells"][0]["outputs"]]
    assert len(frame) == len(outputs) * sum(cell["trials"] for cell in summary["cells"])
    ok = frame.status == "ok"
    figures = [name for name in FAILING if name in frame]
    assert frame.loc[ok, figures].notna().all().all()
    assert frame.loc[~ok, figures].isna().all().all()
    assert frame.loc[ok, "unstable"].notna().all()
    for (cell, estimator, number), rows in frame.groupby(["cell", "estimator", "pass"]):
        output = summary["cells"][cell]["outputs"][outputs.index((estimator, number))]
        place = (cell, estimator, number)
        assert np.array_equal(np.sort(rows.trial), np.arange(len(rows))), place
        assert (rows.status != "ok").sum() == sum(output["outcomes"]["failures"].values()), place
        assert (rows.unstable == True).sum() == output["outcomes"]["unstable"], place  # noqa: E712, nulls are there
        for figure in figures:
            of = output["figures"][figure]
            values = rows[figure].dropna()
            assert len(values) == of["count"], (place, figure)
            if len(values) and of["mean"]["value"] is not None:
                assert np.isclose(values.mean(), float(of["mean"]["value"]), rtol=1e-8, atol=0), (place, figure)


for folder in map(Path, sys.argv[1:]):
    summary = json.loads((folder / "summary.json").read_text())
    figures = both(folder / "summary.parquet")
    check_summary(figures, summary)
    text = f"{folder}: {len(figures)} rows of figures"
    if (folder / "trials.parquet").exists():
        trials = both(folder / "trials.parquet")
        check_trials(trials, summary)
        text += f", {len(trials)} rows of trials"
    print(f"{text}, the same by pandas {pd.__version__} and DuckDB {duckdb.__version__}")
