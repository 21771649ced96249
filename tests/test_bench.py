import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]


def rows_of(*options: str) -> list[dict[str, Any]]:
    command = [sys.executable, "-m", "examples.bench", "--quick", "--json", *options]
    alone = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=alone, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    rows: list[dict[str, Any]] = json.loads(done.stdout)
    return rows


def is_whole(row: dict[str, Any]) -> bool:
    """Whether a row has a ratio and its ends, or names its missing peer; and whether ``met`` agrees with the goal."""
    if row["peer_name"].endswith("not here"):
        shown = (row["ratio"], row["peer"]) == (None, None)
    else:
        figures = [row[key] for key in ("lutgen", "peer", "ratio", "low", "high")]
        shown = all(math.isfinite(figure) and figure > 0 for figure in figures)
        shown &= row["low"] <= row["ratio"] <= row["high"]
    met = row["ratio"] is not None and row["goal"] is not None and row["ratio"] >= row["goal"]
    return bool(shown and (row["met"] == "yes") == met)


@pytest.mark.slow
def test_two_parts_have_whole_rows() -> None:
    rows = rows_of("--only", "evaluation", "--only", "applying")
    assert len(rows) > 5
    assert not [row for row in rows if not is_whole(row)]


@pytest.mark.slow
@pytest.mark.rare(instead="test_two_parts_have_whole_rows")
def test_every_row_is_whole_and_stands_once() -> None:
    rows = rows_of()
    assert not [row for row in rows if not is_whole(row)]
    named = [(row["what"], row["peer_name"]) for row in rows]
    assert len(named) > 20
    assert sorted(named) == sorted(set(named))
