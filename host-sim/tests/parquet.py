"""The trials that host-sim writes, read by pyarrow, a reader that is not ours: rows, columns and figures.

    python parquet.py HOST_SIM FOLDER

Names and types of the columns, the numbers of all trials in their order, outcomes and percentiles as monte-carlo.json
has them, and single trials run again alone, to the bit.
"""

import json
import math
import struct
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet

TRIALS, CHUNK = 230, 64
PLAN = [
    "--uncertain", "60", "--vary", "controller.k_l=list(5,50,100)", "--vary", "controller.fallback=list(hold,0)",
    "--set", "span_s=2", "--set", "window_s=[1, 2]", "--set", "sensor.noise=[1e-4, 0, 0, 0]",
    "--trials", str(TRIALS), "--chunk", str(CHUNK),
]
PERCENTILES = {"p1": 10, "p5": 50, "p50": 500, "p95": 950, "p99": 990, "p99.9": 999, "max": 1000}


def bits(value):
    """A number as it is stored; all that are none are alike."""
    return "none" if value is None or math.isnan(value) else struct.pack("<d", value).hex()


def number_at(told, path):
    """The number of run.json at a path; NaN where there is none."""
    for key in path.split("."):
        told = told[int(key)] if isinstance(told, list) else (told or {}).get(key)
    return math.nan if told is None else float(told)


def percentile(values, per_mille):
    """The least that so many thousandths do not exceed; what is no number is above all."""
    values = sorted(values, key=lambda value: (math.isnan(value), value))
    return values[max(1, math.ceil(per_mille * len(values) / 1000)) - 1]


def main(program, folder):
    command = [program, "monte-carlo", *PLAN, "--out", folder]
    told = json.loads(subprocess.run([*command, "--json"], check=True, capture_output=True, text=True).stdout)
    file = pyarrow.parquet.ParquetFile(Path(folder, "trials.parquet"))
    schema, table = file.schema_arrow, file.read()
    names = ["trial", "outcome", *told["columns"]]
    assert schema.names == names, schema.names
    kinds = ["int64", "string"] + ["double"] * len(told["columns"])
    assert [str(kind) for kind in schema.types] == kinds, schema.types
    groups = [file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups)]
    assert groups == [64, 64, 64, 38], groups
    columns = {name: table.column(name).to_pylist() for name in names}
    assert columns["trial"] == list(range(TRIALS)) and not any(table.column(name).null_count for name in names)

    words = columns["outcome"]
    assert {word: words.count(word) for word in words} == told["outcomes"], told["outcomes"]
    assert set(columns["controller.k_l"]) == {5.0, 50.0, 100.0} and set(columns["controller.fallback"]) == {1.0, 2.0}
    for name in told["columns"]:
        of = told["percentiles"][name]
        for rank, per_mille in PERCENTILES.items():
            found = percentile(columns[name], per_mille)
            assert bits(found) == bits(of[rank]), f"{name}, {rank}: {found} {of[rank]}"
        assert of["no_number"] == sum(map(math.isnan, columns[name])), name
    for worst in told["worst"]:
        assert words[worst["trial"]] == worst["outcome"]
        assert bits(columns[told["worst_by"]][worst["trial"]]) == bits(worst["figure"]), worst

    figures = told["columns"][told["columns"].index("ended_at_s"):]
    trials = [0, 63, 64, TRIALS - 1, told["worst"][0]["trial"]]
    for trial in trials:
        alone = json.loads(subprocess.run(
            [*command, "--json", "--replay", str(trial)], check=True, capture_output=True, text=True).stdout)
        for name in figures:
            stored, run = columns[name][trial], number_at(alone, name)
            assert bits(stored) == bits(run), f"trial {trial}, {name}: {stored} {run}"
    print(f"{table.num_rows} rows of {table.num_columns} columns in {len(groups)} groups; percentiles of "
          f"{len(told['columns'])} columns and trials {trials} run alone, to the bit")


if __name__ == "__main__":
    main(*sys.argv[1:])
