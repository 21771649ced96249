"""Colorimetry against colour-science, published tables and OpenColorIO."""

from collections.abc import Callable

import numpy as np
import pytest

from lutgen.bindings import ocio
from lutgen.colorimetry import (
    CHUNK,
    D65,
    LINEAR_TO_XYZ,
    SRGB_XY,
    XYZ_TO_LINEAR,
    Array,
    code_to_linear,
    delta_e_2000,
    linear_to_code,
    linear_to_lab,
    linear_to_xyz,
    rgb_to_xyz_matrix,
    transform,
    xyY_to_xyz,
    xyz_to_linear,
    xyz_to_xyY,
)

pytestmark = pytest.mark.filterwarnings(
    # At import colour-science warns of missing optional packages. The tests need none of these packages.
    "ignore::colour.utilities.ColourUsageWarning"
)

#: IEC 61966-2-1:1999, linear sRGB to XYZ, and section 5.3 of its amendment: XYZ to linear sRGB; four decimals.
IEC_TO_XYZ = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
IEC_FROM_XYZ = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]

#: Sharma, Wu & Dalal 2005, table 1: L*, a*, b*, L*, a*, b*, ΔE2000.
SHARMA = [
    (50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425),
    (50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615),
    (50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412),
    (50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000),
    (50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000),
    (50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000),
    (50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669),
    (50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195),
    (50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045),
    (50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045),
    (50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461),
    (50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065),
    (50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492),
    (50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977),
    (50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030),
    (50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535),
    (50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000),
    (50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000),
    (50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000),
    (50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000),
    (60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644),
    (63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630),
    (61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731),
    (35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645),
    (22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373),
    (36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146),
    (90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441),
    (90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381),
    (6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377),
    (2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082),
]


@pytest.fixture(scope="module")
def colours() -> Array:
    """Linear sRGB: random, corners, greys, and values on both sides of each break of a curve."""
    random = np.random.default_rng(1)
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    breaks = np.array([0.0031308, 0.0031307, 0.0031309, 0.008856, 0.0088, 0.0089])
    return np.concatenate([random.random((5000, 3)), corners, np.repeat(breaks[:, np.newaxis], 3, axis=1)])


def test_xyz_and_chromaticity_agree_with_colour_science(colours: Array) -> None:
    import colour

    xyz = linear_to_xyz(colours[colours.sum(axis=1) > 0])
    np.testing.assert_allclose(xyz_to_xyY(xyz), colour.XYZ_to_xyY(xyz), rtol=0, atol=1e-14)
    xyY = xyz_to_xyY(xyz)
    np.testing.assert_allclose(xyY_to_xyz(xyY), colour.xyY_to_XYZ(xyY), rtol=0, atol=1e-14)


def test_chromaticity_comes_back_from_xyz(colours: Array) -> None:
    xyz = linear_to_xyz(colours[colours.sum(axis=1) > 0])
    np.testing.assert_allclose(xyY_to_xyz(xyz_to_xyY(xyz)), xyz, rtol=0, atol=1e-14)


def test_black_has_no_chromaticity_and_warns_of_nothing() -> None:
    x, y, luminance = xyz_to_xyY([0.0, 0.0, 0.0])
    assert np.isnan(x)
    assert np.isnan(y)
    assert luminance == 0.0


def test_the_srgb_matrices_are_those_that_iec_prints() -> None:
    np.testing.assert_array_equal(np.round(LINEAR_TO_XYZ, 4), IEC_TO_XYZ)
    # IEC inverted the rounded matrix, with an error of up to 4e-4: the test compares with this inverse.
    np.testing.assert_array_equal(np.round(np.linalg.inv(np.round(LINEAR_TO_XYZ, 4)), 4), IEC_FROM_XYZ)
    np.testing.assert_allclose(XYZ_TO_LINEAR, IEC_FROM_XYZ, rtol=0, atol=4e-4)


@pytest.mark.parametrize("name", ["sRGB", "Display P3", "ITU-R BT.2020", "Adobe RGB (1998)"])
def test_the_matrix_of_a_display_agrees_with_colour_science(name: str) -> None:
    import colour

    space = colour.RGB_COLOURSPACES[name]
    expected = colour.normalised_primary_matrix(space.primaries, space.whitepoint)
    xy = np.vstack([space.whitepoint, space.primaries])
    np.testing.assert_allclose(rgb_to_xyz_matrix(xy), expected, rtol=0, atol=1e-14)


def test_white_of_the_srgb_display_is_d65() -> None:
    np.testing.assert_allclose(xyz_to_xyY(D65), [*SRGB_XY[0], 1.0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(linear_to_lab([1.0, 1.0, 1.0]), [100.0, 0.0, 0.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(linear_to_lab([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0], rtol=0, atol=1e-12)


def test_lab_agrees_with_colour_science(colours: Array) -> None:
    import colour

    expected = colour.XYZ_to_Lab(linear_to_xyz(colours), SRGB_XY[0])
    np.testing.assert_allclose(linear_to_lab(colours), expected, rtol=0, atol=1e-11)


def test_linear_light_comes_back_from_xyz(colours: Array) -> None:
    np.testing.assert_allclose(xyz_to_linear(linear_to_xyz(colours)), colours, rtol=0, atol=2e-15)


def test_the_srgb_curves_agree_with_colour_science(colours: Array) -> None:
    import colour

    # colour-science breaks the curve at the code of 0.0031308, which is 3e-8 below IEC's 0.04045.
    codes = np.concatenate([colours, [[0.04, 0.0404499, 0.0404501], [0.0, 0.5, 1.0]]])
    np.testing.assert_allclose(code_to_linear(codes), colour.models.eotf_sRGB(codes), rtol=0, atol=1e-15)
    np.testing.assert_allclose(linear_to_code(colours), colour.models.eotf_inverse_sRGB(colours), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("code", "linear"), [(0.04045, 0.04045 / 12.92), (0.04045 + 1e-12, ((0.04045 + 1e-12 + 0.055) / 1.055) ** 2.4)]
)
def test_the_srgb_curve_breaks_where_iec_says(code: float, linear: float) -> None:
    assert float(code_to_linear(code)) == pytest.approx(linear, rel=1e-15)


def test_codes_come_back_through_the_srgb_curves_at_their_break_too() -> None:
    codes = np.linspace(0.04044, 0.04046, 20_001)
    np.testing.assert_allclose(linear_to_code(code_to_linear(codes)), codes, rtol=0, atol=1e-12)


def test_every_8_bit_code_comes_back_through_the_srgb_curves() -> None:
    codes = np.arange(256) / 255
    np.testing.assert_allclose(linear_to_code(code_to_linear(codes)), codes, rtol=0, atol=5e-16)


def test_the_srgb_curve_goes_on_outside_0_to_1_as_opencolorio_does() -> None:
    lib = ocio()
    curve = lib.ExponentWithLinearTransform(
        gamma=[2.4, 2.4, 2.4, 1.0], offset=[0.055, 0.055, 0.055, 0.0], negativeStyle=lib.NEGATIVE_LINEAR
    )
    processor = lib.Config.CreateRaw().getProcessor(curve)
    code = np.array([-0.5, -0.1, -0.01, 0.0, 0.01, 0.5, 1.0, 1.1, 1.5])
    shown = np.repeat(code[:, np.newaxis], 3, axis=1).astype(np.float32)
    processor.getDefaultCPUProcessor().applyRGB(shown)
    # OpenColorIO's straight piece has slope 1/12.9232, and IEC rounds to 12.92: a difference of 3e-4 of the value.
    np.testing.assert_allclose(code_to_linear(code), shown[:, 0], rtol=3e-4, atol=1e-7)


@pytest.mark.parametrize("pair", SHARMA)
def test_ciede2000_gives_the_published_difference(pair: tuple[float, ...]) -> None:
    first, second, expected = np.array(pair[:3]), np.array(pair[3:6]), pair[6]
    assert round(float(delta_e_2000(first, second)), 4) == expected
    assert round(float(delta_e_2000(second, first)), 4) == expected


#: Kind → function from random Lab colours to two sets of Lab colours.
PAIRS_BY_HAND: dict[str, Callable[[Array], tuple[Array, Array]]] = {
    "anywhere": lambda lab: (lab, lab[::-1]),
    "near": lambda lab: (lab, lab + 0.005 * lab[::-1]),
    "one grey": lambda lab: (lab, lab[::-1] * [1.0, 0.0, 0.0]),
    "both grey": lambda lab: (lab * [1.0, 0.0, 0.0], lab[::-1] * [1.0, 0.0, 0.0]),
    "nearly grey": lambda lab: (lab * [1.0, 1e-6, 1e-6], lab[::-1] * [1.0, 1e-6, 1e-6]),
    "blue, where the rotation acts": lambda lab: (
        lab * [1.0, 0.3, 0.0] + [0.0, 0.0, -60.0],
        lab[::-1] * [1.0, 0.3, 0.1] + [0.0, 0.0, -50.0],
    ),
}


def lab_pairs(kind: str) -> tuple[Array, Array]:
    """Random pairs of Lab colours. Each kind tests another branch of the formula."""
    random = np.random.default_rng(2)
    lab = np.array([100.0, 200.0, 200.0]) * random.random((20_000, 3)) - np.array([0.0, 100.0, 100.0])
    if kind in PAIRS_BY_HAND:
        return PAIRS_BY_HAND[kind](lab)
    # Hues 180° ± 1e-5…10° apart, on both sides.
    hue = random.uniform(0.0, 2 * np.pi, len(lab))
    turn = np.pi + np.radians(10.0 ** random.uniform(-5, 1, len(lab))) * random.choice([-1, 1], len(lab))
    chroma_1, chroma_2 = random.uniform(1.0, 100.0, (2, len(lab)))
    first = np.column_stack([lab[:, 0], chroma_1 * np.cos(hue), chroma_1 * np.sin(hue)])
    second = np.column_stack([lab[::-1, 0], chroma_2 * np.cos(hue + turn), chroma_2 * np.sin(hue + turn)])
    return first, second


@pytest.mark.parametrize("kind", [*PAIRS_BY_HAND, "hues nearly opposite"])
def test_ciede2000_agrees_with_colour_science(kind: str) -> None:
    import colour

    first, second = lab_pairs(kind)
    expected = colour.delta_E(first, second, method="CIE 2000")
    np.testing.assert_allclose(delta_e_2000(first, second), expected, rtol=0, atol=1e-10)


def test_ciede2000_is_0_for_a_colour_and_itself_and_symmetric_otherwise() -> None:
    first, second = lab_pairs("anywhere")
    assert (delta_e_2000(first, first) == 0).all()
    np.testing.assert_allclose(delta_e_2000(first, second), delta_e_2000(second, first), rtol=0, atol=1e-12)


def test_ciede2000_takes_any_shape_and_does_not_see_its_chunks() -> None:
    random = np.random.default_rng(3)
    lab = random.uniform(0, 100, (CHUNK + 7, 3))
    whole = delta_e_2000(lab, lab[0])
    assert whole.shape == (CHUNK + 7,)
    around = slice(CHUNK - 3, CHUNK + 7)
    np.testing.assert_allclose(whole[around], delta_e_2000(lab[around], lab[0]), rtol=1e-14, atol=0)
    assert delta_e_2000(lab[:6].reshape(2, 3, 3), lab[:3]).shape == (2, 3)


@pytest.mark.parametrize("shape", [(3,), (1, 3), (7, 3), (4, 5, 3)])
def test_transform_multiplies_each_vector_by_the_matrix(shape: tuple[int, ...]) -> None:
    random = np.random.default_rng(4)
    matrix, signal = random.normal(size=(3, 3)), random.normal(size=shape)
    expected = np.einsum("ij,...j->...i", matrix.astype(np.longdouble), signal.astype(np.longdouble))
    result = transform(matrix, signal)
    assert result.shape == shape
    np.testing.assert_allclose(result, expected.astype(np.float64), rtol=0, atol=1e-14)


def test_transform_takes_matrices_that_are_not_square() -> None:
    random = np.random.default_rng(5)
    matrix, signal = random.normal(size=(3, 12)), random.normal(size=(9, 12))
    np.testing.assert_allclose(transform(matrix, signal), signal @ matrix.T, rtol=0, atol=1e-13)


def test_transform_gives_a_colour_the_same_bits_wherever_it_stands() -> None:
    random = np.random.default_rng(6)
    matrix, signal = random.normal(size=(3, 3)), random.random((1001, 3))
    whole = transform(matrix, signal)
    for row in (0, 1, 17, 1000):
        one = signal[row].tolist()
        # Column by column, in plain Python floats.
        literal = [(m[0] * one[0] + m[1] * one[1]) + m[2] * one[2] for m in matrix.tolist()]
        assert whole[row].tolist() == literal
        assert transform(matrix, signal[row]).tolist() == literal


def test_transform_does_not_write_into_its_input() -> None:
    signal = np.ones((4, 3))
    transform(np.full((3, 3), 2.0), signal)
    assert (signal == 1).all()
