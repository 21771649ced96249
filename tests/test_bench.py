from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]

#: What each row compares, without the sizes, which are small here; and the peers of such a row.
ROWS = {
    "evaluate": {"colour-science"},
    "write .cube": {"OpenColorIO Baker", "colour.write_LUT", "numpy.savetxt", "the limit"},
    "evaluate + write .cube": {"OpenColorIO Baker"},
    "build 6 .cube and configs, no certificates": {"ociobakelut"},
    "build 6 .cube and configs, certificates": {"ociobakelut"},
    "peak memory": {"the limit"},
    **{
        f"apply {how} to 0.06 Mpx, {form}": {"OpenImageIO", "oiiotool"}
        for how in ("model", "LUT")
        for form in ("PNG 8", "TIFF 8", "TIFF 16", "EXR half")
    },
    "compare 216 readings at 3 hours": {"the limit"},
    **{
        f"diagnose 216 readings at 3 hours, {what} hidden": {"the limit"}
        for what in ("nothing", "one effect", "two effects", "two effects of typical size")
    },
    "fit of black-level": {"scipy.optimize.least_squares"},
    "held-out error": {"a fit for each"},
    "ΔE2000 of": {"colour.delta_E"},
    "3 hours × 2 modes, 0.06 Mpx": {"colour-science on every pixel"},
    "3 hours × 2 modes of an image tiled": {"the same image once"},
    "the same, 16 bits": {"the limit"},
    "lutgen --help": {"the limit"},
}


@pytest.fixture(scope="module")
def rows() -> list[dict[str, Any]]:
    command = [sys.executable, "-m", "examples.bench", "--quick", "--json"]
    alone = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=alone, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    table: list[dict[str, Any]] = json.loads(done.stdout)
    return table


@pytest.mark.slow
@pytest.mark.parametrize(("what", "peers"), ROWS.items())
def test_the_table_has_every_row(rows: list[dict[str, Any]], what: str, peers: set[str]) -> None:
    names = [row["peer_name"] for row in rows if row["what"].startswith(what)]
    assert all(any(name.startswith(peer) for name in names) for peer in peers), names


@pytest.mark.slow
def test_every_ratio_is_a_number_or_its_peer_is_said_to_be_missing(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        if row["peer_name"].endswith("not here"):
            assert (row["ratio"], row["peer"]) == (None, None)
        else:
            figures = [row[key] for key in ("lutgen", "peer", "ratio", "low", "high")]
            assert all(math.isfinite(figure) and figure > 0 for figure in figures), row
            assert row["low"] <= row["ratio"] <= row["high"]


@pytest.mark.slow
def test_goals_are_judged_where_there_are_any(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        met = row["ratio"] is not None and row["goal"] is not None and row["ratio"] >= row["goal"]
        assert (row["met"] == "yes") == met
