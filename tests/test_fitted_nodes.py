"""Fitted nodes: the least squares by another method, and the change of tissue colours."""

import hashlib
import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lutgen import DisplayModel, read_measurements
from lutgen.bake.fitted_nodes import HEADROOM, fit_beside_clip, ramps_at_white
from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Sampler, table_of
from lutgen.bake.spaces import SPACES, lattice, tetrahedra
from lutgen.colorimetry import Array, linear_to_code
from lutgen.display import default_display
from tests.quick import mostly_slow

pytestmark = pytest.mark.numbers

#: SHA-256 of aged.cube, 33³, of the default display in chroma, by hours. Another processor changes no digit.
HASHES = {
    8_000.0: "5ba27c7a3d4fb288f09837724a7885ee3043d48b95bd3f92ec65d0a39acd39c6",
    18_000.0: "469e9b0e6d91ebc72ab0a634ed62c9a5d82a9074c10ba42f010acfc275265913",
}

FIELDS = [Path(os.environ.get("LUTGEN_REAL_DATA", ""), "images", f"he_{name}.png") for name in "ab"]


@pytest.mark.parametrize(("before", "beyond"), [(0.9975, 1.0005), (0.985, 1.02), (0.999, 1.04), (0.94, 1.003)])
@pytest.mark.parametrize("channel", [0, 1, 2])
@pytest.mark.parametrize("top", [1.0, HEADROOM])
def test_the_node_before_the_clip_errs_as_much_as_the_line_at_the_bend_or_by_half_a_code(
    channel: int, before: float, beyond: float, top: float
) -> None:
    line = np.array([2 * before - beyond, before, beyond])
    values = np.full((3, 3, 3, 3), 0.5)
    np.moveaxis(values[..., channel], 2 - channel, -1)[:] = line
    shown = fitted(values, top)
    along = np.moveaxis(shown[..., channel], 2 - channel, -1)
    node = float(along[0, 0, 1])
    held = min(beyond, top)
    np.testing.assert_array_equal(along, np.broadcast_to([line[0], node, held], along.shape))
    np.testing.assert_array_equal(np.delete(shown, channel, axis=-1), 0.5)
    place = np.linspace(0.0, 1.0, 100_001)
    lacks = np.minimum(before + (beyond - before) * place, 1) - np.minimum(node + (held - node) * place, 1)
    raised = node - before
    assert 0 <= raised <= 0.5 / 255 + 1e-12
    if raised < 0.5 / 255 - 1e-9:
        assert lacks.max() == pytest.approx(raised, abs=1e-6)
    else:
        assert lacks.max() > raised


def fitted(values: Array, top: float = HEADROOM) -> Array:
    table = values.copy()
    fit_beside_clip(table, top)
    return table


def test_a_table_that_meets_no_clip_at_white_stays() -> None:
    values = np.random.default_rng(5).uniform(-0.2, 1.0, (9, 9, 9, 3))
    np.testing.assert_array_equal(fitted(values), np.clip(values, 0, 1))


@pytest.mark.parametrize(("space", "size"), [("code", 17), ("code", 33), ("linear", 17)])
def test_ramps_come_nearer_to_the_step_than_a_table_of_the_step_itself(space: str, size: int) -> None:
    """On colours outside the fit, the squared error that no such table can avoid falls by at least a seventh."""
    nodes, shares = ramps_at_white(space, size)
    assert np.abs(shares).max() < 1.5
    step = lattice_side(lattice(size, space))
    code = SPACES[space].code(np.random.default_rng(8).random((60_000, 3)))
    mixed, weights = tetrahedra(code, space, size)
    touched = np.isin(mixed, nodes).any(axis=1)
    mixed, weights, wanted = mixed[touched], weights[touched], lattice_side(code[touched])

    def squares(moved: Array) -> float:
        table = step.copy()
        table[nodes] += moved
        return float(np.square((weights * table[mixed]).sum(axis=1) - wanted).mean())

    assert squares(shares) < 0.85 * squares(np.zeros_like(shares))
    # No other length of the same change is much nearer.
    for factor in (0.5, 1.5):
        assert squares(shares) < squares(factor * shares)


def lattice_side(code: Array) -> Array:
    """1 where white is the nearest colour point in linear light, else 0; one half on the border."""
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    beyond = linear.sum(axis=1) - linear.max(axis=1) - 1.0
    return np.asarray(np.where(np.abs(beyond) < 1e-9, 0.5, beyond > 0))


@pytest.mark.parametrize("hours", [8_000.0, 18_000.0])
def test_a_file_with_fitted_nodes_has_the_same_bytes_on_every_binding(hours: float) -> None:
    """The hash fixes the bytes. `make test-quick-other` compares the hash with the other build of OpenColorIO."""
    aged = DisplayModel(read_measurements(default_display())).at("chroma", hours)
    form = format_named("cube")
    (lut,) = form.bake(Sampler(), aged, 33)
    plain = linear_to_code(Sampler().linear(aged, 33, "code")).reshape(33, 33, 33, 3)
    assert (np.abs(table_of(lut) - np.clip(plain, 0, HEADROOM)) > 1e-4).sum() > 1000
    data = form.write(lut, Provenance("Aged display", "lutgen", ("display: default",)))
    assert hashlib.sha256(data).hexdigest() == HASHES[hours]


@pytest.mark.skipif(
    not FIELDS[0].is_file(), reason="LUTGEN_REAL_DATA is not set: the H&E fields are not published here"
)
@pytest.mark.parametrize("path", FIELDS, ids=["a", "b"])
@pytest.mark.parametrize(
    "hours",
    mostly_slow([3_000.0, 4_000.0, 7_000.0, 8_000.0, 10_000.0, 16_000.0, 17_000.0, 18_000.0], 8_000.0, 18_000.0),
)
def test_on_h_and_e_99_of_100_values_are_within_half_a_code(path: Path, hours: float) -> None:
    with Image.open(path) as image:
        code = np.asarray(image.convert("RGB")).reshape(-1, 3) / 255
    aged = DisplayModel(read_measurements(default_display())).at("chroma", hours)
    shown = np.clip(Sampler().lut(aged, 33, "code", clip=True).apply(code), 0, 1)
    assert np.quantile(np.abs(shown - aged.code_to_code(code)), 0.99) * 255 <= 0.5
