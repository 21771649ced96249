"""The report on real programs: it can fail, it covers every program, and OpenColorIO equals the direct model.

``make consumers`` runs the programs, which are in ``tests/consumers``.
"""

from itertools import permutations

import numpy as np
import pytest

from lutgen.bindings import ocio
from lutgen.colorimetry import LINEAR_TO_XYZ, Array, linear_to_code, transform
from tests.consumers import opencolorio
from tests.consumers._gallery import CASES, GATES, Case, Gallery, aged, errors, expected, gates

pytestmark = pytest.mark.filterwarnings(
    # At import colour-science warns of missing optional packages. The tests need none of these packages.
    "ignore::colour.utilities.ColourUsageWarning"
)

NEAREST = [case for case in CASES if case.selection == "nearest"]
CONTINUOUS = next(case for case in CASES if case.selection == "continuous")


@pytest.fixture(scope="module")
def gallery(tmp_path_factory: pytest.TempPathFactory) -> Gallery:
    return Gallery(tmp_path_factory.mktemp("consumers"), formats=("clf",))


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_picture_that_has_not_aged_passes_no_gate(gallery: Gallery, case: Case) -> None:
    error = gallery.errors(gallery.image, case)
    assert not any(error.passes(limit) for limit in gates(case).values()), error


@pytest.mark.parametrize(("shown", "meant"), [*permutations(NEAREST, 2)], ids=str)
def test_a_picture_of_another_mode_or_hour_passes_no_gate(shown: Case, meant: Case) -> None:
    error = errors(expected(shown), expected(meant))
    assert not any(error.passes(limit) for limit in gates(meant).values()), error


def test_a_program_that_interpolates_trilinearly_instead_does_not_pass(gallery: Gallery) -> None:
    lib, job = ocio(), gallery.job(CONTINUOUS)
    # The interpolation that a CLF states has precedence over the config.
    altered = job.scratch / "trilinear.clf"
    altered.write_text(job.clf.read_text().replace('interpolation="tetrahedral"', 'interpolation="trilinear"'))
    processor = lib.Config.CreateRaw().getProcessor(lib.FileTransform(src=str(altered)))
    error = gallery.errors(opencolorio.apply(processor, job.image), CONTINUOUS)
    assert not error.passes(GATES["tetrahedral"]), error


def test_a_picture_with_one_value_that_is_no_number_passes_no_gate() -> None:
    picture = expected(CONTINUOUS).copy()
    picture[0, 0, 0] = np.nan
    error = errors(picture, expected(CONTINUOUS))
    assert not any(error.passes(limit) for limit in gates(CONTINUOUS).values()), error


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_wider_viewer_shows_aged_colours_that_srgb_must_clip(gallery: Gallery, case: Case) -> None:
    # Codes of 8-bit pictures. Aging moves some of the saturated colours out of sRGB.
    codes = np.random.default_rng(5).integers(0, 256, (300, 300, 3), dtype=np.uint8)
    linear = aged(case).code_to_linear(codes / 255)
    wide = linear_to_p3(linear)
    only_wide = ((linear < -1e-3) | (linear > 1 + 1e-3)).any(axis=-1) & ((wide >= 0) & (wide <= 1)).all(axis=-1)
    assert only_wide.mean() > 0.01
    shown = opencolorio.through_display(gallery.job(case).config, "Display P3", codes)
    reached, aim = shown[only_wide], linear_to_code(wide[only_wide])
    assert errors(reached, aim).passes(GATES["tetrahedral"]), errors(reached, aim)
    clipped = linear_to_code(linear_to_p3(np.clip(linear, 0, 1)))[only_wide]
    assert not errors(clipped, aim).passes(GATES["tetrahedral"])


def linear_to_p3(linear: Array) -> Array:
    """Linear sRGB → linear Display P3, by colour-science's primaries and white; shape (..., 3)."""
    import colour

    space = colour.RGB_COLOURSPACES["Display P3"]
    to_xyz = colour.normalised_primary_matrix(space.primaries, space.whitepoint)
    matrix = np.linalg.inv(to_xyz) @ LINEAR_TO_XYZ
    return transform(matrix, linear.reshape(-1, 3)).reshape(linear.shape)
