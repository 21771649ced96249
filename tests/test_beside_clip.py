"""Nodes beside the clip: the least squares by another way, and what becomes of pale tissue."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.optimize import minimize_scalar

from lutgen import DisplayModel, read_measurements
from lutgen.bake.beside_clip import HEADROOM, PLACES, fitted_beside_clip
from lutgen.bake.lut import Sampler
from lutgen.display import default_display

FIELDS = [Path(os.environ.get("LUTGEN_REAL_DATA", ""), "images", f"he_{name}.png") for name in "ab"]


@pytest.mark.parametrize(("before", "beyond"), [(0.97, 1.001), (0.985, 1.02), (0.999, 1.04), (0.94, 1.003)])
@pytest.mark.parametrize("channel", [0, 1, 2])
def test_the_node_before_the_clip_has_the_least_squares_over_its_two_cells(
    channel: int, before: float, beyond: float
) -> None:
    line = np.array([2 * before - beyond, before, beyond])
    values = np.full((3, 3, 3, 3), 0.5)
    np.moveaxis(values[..., channel], 2 - channel, -1)[:] = line
    held = min(beyond, HEADROOM)

    def squares(node: float) -> float:
        last = np.minimum(before + (beyond - before) * PLACES, 1) - np.minimum(node + (held - node) * PLACES, 1)
        first = (before - node) * PLACES
        return float((last**2).sum() + (first**2).sum())

    best = minimize_scalar(squares, bounds=(before, 1.0), method="bounded", options={"xatol": 1e-9}).x
    fitted = np.moveaxis(fitted_beside_clip(values)[..., channel], 2 - channel, -1)
    np.testing.assert_allclose(fitted, np.broadcast_to([line[0], best, held], fitted.shape), rtol=0, atol=2e-5)
    others = np.delete(fitted_beside_clip(values), channel, axis=-1)
    np.testing.assert_array_equal(others, 0.5)


def test_a_table_that_meets_no_clip_at_white_stays() -> None:
    values = np.random.default_rng(5).uniform(-0.2, 1.0, (9, 9, 9, 3))
    np.testing.assert_array_equal(fitted_beside_clip(values), np.clip(values, 0, 1))


@pytest.mark.skipif(
    not FIELDS[0].is_file(), reason="LUTGEN_REAL_DATA is not set: the H&E fields are not published here"
)
@pytest.mark.parametrize("path", FIELDS, ids=["a", "b"])
@pytest.mark.parametrize(("hours", "limit"), [(3_000.0, 0.5), (10_000.0, 0.5), (15_000.0, 0.5), (18_000.0, 0.6)])
def test_on_h_and_e_99_of_100_values_are_within_half_a_code(path: Path, hours: float, limit: float) -> None:
    """At 18 000 h the clip and the jump of `nearest` leave up to 0.58: values above white end at the headroom."""
    with Image.open(path) as image:
        code = np.asarray(image.convert("RGB")).reshape(-1, 3)[::5] / 255
    aged = DisplayModel(read_measurements(default_display())).at("chroma", hours)
    shown = np.clip(Sampler().lut(aged, 33, "code", clip=True).apply(code), 0, 1)
    assert np.quantile(np.abs(shown - aged.code_to_code(code)), 0.99) * 255 <= limit
