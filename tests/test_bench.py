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


@pytest.mark.slow
def test_every_row_stands_once_and_has_a_ratio_or_says_that_its_peer_is_missing() -> None:
    command = [sys.executable, "-m", "examples.bench", "--quick", "--json"]
    alone = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=alone, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    rows: list[dict[str, Any]] = json.loads(done.stdout)
    named = [(row["what"], row["peer_name"]) for row in rows]
    assert len(named) > 20
    assert sorted(named) == sorted(set(named))
    for row in rows:
        if row["peer_name"].endswith("not here"):
            assert (row["ratio"], row["peer"]) == (None, None)
        else:
            figures = [row[key] for key in ("lutgen", "peer", "ratio", "low", "high")]
            assert all(math.isfinite(figure) and figure > 0 for figure in figures), row
            assert row["low"] <= row["ratio"] <= row["high"]
        met = row["ratio"] is not None and row["goal"] is not None and row["ratio"] >= row["goal"]
        assert (row["met"] == "yes") == met
