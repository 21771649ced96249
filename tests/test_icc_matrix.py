"""``icc-matrix``: the error of a matrix for a display; ``make consumers`` tests its white with LittleCMS."""

import numpy as np
import pytest

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Lut, MatrixLut, Sampler
from lutgen.colorimetry import Array, code_to_linear, delta_e_2000, linear_to_lab
from lutgen.display import DisplayModel, default_display
from lutgen.readings import read_measurements

pytestmark = pytest.mark.numbers

PROVENANCE = Provenance("Aged display, chroma", "lutgen-chroma", ("lutgen: what it shows", "hours: 18000"))


@pytest.mark.parametrize("selection", ["nearest", "continuous"])
@pytest.mark.parametrize("mode", ["chroma", "chroma-luma"])
def test_the_matrix_errs_by_as_much_as_the_readme_says(selection: str, mode: str) -> None:
    """No matrix of the primaries, scaled to white, has a smaller error."""
    aged = DisplayModel(read_measurements(default_display()), selection=selection).at(mode, 18_000)
    (lut,) = format_named("icc-matrix").bake(Sampler(), aged, 33)
    code = np.random.default_rng(31).random((4000, 3))
    aim = linear_to_lab(np.clip(aged.code_to_linear(code), 0, 1))
    *primaries, white = aged.code_to_linear(np.vstack([np.eye(3), np.ones(3)]))
    columns = np.transpose(primaries)
    scaled = columns * np.linalg.solve(columns, white)

    def error(matrix: Array) -> Array:
        return delta_e_2000(aim, linear_to_lab(np.clip(code_to_linear(code) @ matrix.T, 0, 1)))

    assert isinstance(lut, MatrixLut)
    assert np.quantile(error(lut.matrix), 0.99) < 1.0
    assert (error(lut.matrix) ** 2).mean() < 0.95 * (error(scaled) ** 2).mean()


def test_a_display_that_is_a_matrix_is_kept_as_it_is() -> None:
    fresh = DisplayModel(read_measurements(default_display())).at("stable", 0)
    (lut,) = format_named("icc-matrix").bake(Sampler(), fresh, 33)
    assert isinstance(lut, MatrixLut)
    # Steps of 1/65536 in XYZ, through the inverse matrix.
    assert lut.matrix == pytest.approx(np.eye(3), abs=5e-5)


def test_a_matrix_is_no_table() -> None:
    with pytest.raises(TypeError, match="holds a matrix"):
        format_named("icc-matrix").write(Lut("code", np.zeros((2, 2, 2, 3))), PROVENANCE)
