"""Reads trials.parquet with pandas/pyarrow: columns, types, nulls, row counts. Usage: read_parquet.py FILE TRIALS."""

import sys

import pandas as pd

path, trials = sys.argv[1], int(sys.argv[2])
table = pd.read_parquet(path)
assert len(table) == 3 * trials * 5, len(table)
expected = (
    "cell claim eta window trial estimator pass status unstable e_a e_b e_h e_x0 e_x_max e_x_rms spectral_radius condition"
)
missing = set(expected.split()) - set(table.columns)
assert not missing, missing
assert set(table.claim) == {"C1", "C2", "C3"}
assert set(table.eta) == {0.0, 10.018, 10.014}
assert set(zip(table.estimator, table["pass"])) == {("ls", 0), *(("iv", k) for k in range(1, 5))}
ok = table.status == "ok"
assert table.loc[ok, ["e_a", "e_b", "e_h", "e_x0", "e_x_max", "e_x_rms", "spectral_radius"]].notna().all().all()
assert table.loc[~ok, ["e_a", "e_b", "e_h", "e_x0", "e_x_max", "e_x_rms"]].isna().all().all()
assert (table.groupby(["cell", "estimator", "pass"]).trial.nunique() == trials).all()
medians = table[(table.claim == "C2")].groupby(["estimator", "pass"]).e_a.median()
assert 0.06 < medians["ls", 0] < 0.12 and 0.08 < medians["iv", 4] < 0.16, medians
print(f"{path}: {len(table)} rows read by pandas {pd.__version__}, {int((~ok).sum())} with a failure")
