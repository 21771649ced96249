"""The paper's emission: four matrices through the measured tips, and the selection of a matrix for each colour.

Avanaki et al., Proc. SPIE 9420 (2015), steps 2, 3 and 5. A matrix T'_i maps the three colour points other than i to
their measured XYZ; T_i = ⅓ Σ_{j≠i} T'_j then reproduces colour point i exactly.

The matrices differ only by the excess of white over its primaries, D = XYZ_w − XYZ_r − XYZ_g − XYZ_b. ``continuous`` is
the additive display + D·min(r', g', b'). ``nearest`` is the additive display + ⅓D·(r' + g' + b') near white, and
+ ⅓D·(the two smaller channels) near a primary. So ``nearest`` bends, but does not jump, between primaries; at white's
border ``nearest`` jumps by ⅓D·(the largest channel).

Both selections are linear in the matrices, so they are split into two links. ``Selection`` returns a colour's channels
and the light of the primaries whose matrices the colour uses, and does not age. ``Matrices`` multiplies by the matrices
that age.
"""

from dataclasses import dataclass

import numpy as np

from lutgen.colorimetry import XYZ_TO_LINEAR, Array, code_to_linear, transform, xyY_to_xyz
from lutgen.display.chain import AgedDisplay, SrgbTransfer

#: Tolerance for equal distances to colour points (step 6 in docs/explanation/model.md).
TIE = 1e-9


def three_point_matrices(xyz_tips: Array) -> Array:
    """Return T'_w, T'_r, T'_g, T'_b, step 2: (4, 3) tips in XYZ → (4, 3, 3); T'_i · (drive of j) = XYZ_j for j ≠ i."""
    white, *primaries = xyz_tips
    matrices = np.array([np.column_stack(primaries)] * 4)
    for channel in range(3):
        # White is the sum of all columns, so the column of the missing primary is white minus the other two primaries.
        others = sum(primary for other, primary in enumerate(primaries) if other != channel)
        matrices[channel + 1, :, channel] = white - others
    return matrices


def averaged_matrices(three_point: Array) -> Array:
    """Return T_w, T_r, T_g, T_b, step 3 of the paper: T_i = ⅓ Σ_{j≠i} T'_j. Shape (4, 3, 3) → (4, 3, 3)."""
    return np.asarray((three_point.sum(axis=0) - three_point) / 3.0)


def nearest_weights(linear: Array) -> Array:
    """Return the share of each T_i, step 5: (n, 3) → (n, 4) in the order w, r, g, b; rows sum to 1.

    The nearest colour point in linear light (Euclidean distance) has share 1. All points within ``TIE`` of the smallest
    distance have equal shares, so that rounding has no influence on a grey below ½, whose distances to red, green and
    blue are equal.
    """
    red, green, blue = linear.T
    # |l − p|² = |l|² + 1 − 2·score with score r, g, b for the primaries and r+g+b−1 for white. All four distances use
    # the same |l|², so that equal channels give exact ties on every platform.
    squared = red * red + green * green + blue * blue + 1.0
    scores = (red + green + blue - 1.0, red, green, blue)
    return _shares([np.sqrt(np.maximum(squared - 2.0 * score, 0.0)) for score in scores])


def continuous_weights(linear: Array) -> Array:
    """Return the share of each T'_i, (n, 3) → (n, 4): 1 for the smallest channel, equal shares for ties; w is 0."""
    return np.column_stack([np.zeros(len(linear)), _shares(list(linear.T))])


def _shares(sizes: list[Array]) -> Array:
    """Return equal shares for the smallest of k sizes (n,), within ``TIE``, (n, k)."""
    limit = np.minimum.reduce(sizes) + TIE
    smallest = np.array([size <= limit for size in sizes])
    return np.asarray((smallest / np.count_nonzero(smallest, axis=0)).T)


@dataclass(frozen=True)
class Selection:
    """Linear light → channels, and the light that uses the primaries' matrices; the same at every hour."""

    name: str

    def weights(self, linear: Array) -> Array:
        """Return the shares of the matrices, (n, 4), for linear light (n, 3)."""
        return nearest_weights(linear) if self.name == "nearest" else continuous_weights(linear)

    def __call__(self, signal: Array) -> Array:
        """Convert linear light (n, 3) to (n, 4): the channels, and Σ channel · share of the channel's matrix."""
        _, *shares = self.weights(signal).T
        used = sum(share * channel for share, channel in zip(shares, signal.T, strict=True))
        return np.stack([*signal.T, np.asarray(used)]).T


def on_both_sides(signal: Array) -> Array:
    """Return coordinates (n, 4) for white's matrix, then for the nearest primary's matrix, (2 n, 4)."""
    channels = signal[:, :3]
    used = np.concatenate([np.zeros(len(signal)), channels.max(axis=1)])
    return np.stack([*np.tile(channels.T, 2), used]).T


@dataclass(frozen=True)
class Matrices:
    """The aged emission of one mode and hour: (n, 4) coordinates of ``Selection`` → XYZ (n, 3).

    A primary's matrix differs from white's matrix only in the primary's own column. The difference is the same vector
    for all three primaries: -⅓D in T_i, D in T'_i.
    """

    #: T_i (``nearest``) or T'_i (``continuous``) as nested tuples, which can be compared: 4 × 3 × 3.
    values: tuple[tuple[tuple[float, ...], ...], ...]

    @property
    def array(self) -> Array:
        """The four matrices, shape (4, 3, 3)."""
        return np.array(self.values)

    @property
    def matrix(self) -> Array:
        """The matrix from coordinates to XYZ, shape (3, 4)."""
        white, red = np.array(self.values[:2])
        return np.hstack([white, red[:, :1] - white[:, :1]])

    @property
    def to_linear(self) -> Array:
        """The matrix from coordinates to linear sRGB, shape (3, 4); computed without BLAS, like ``transform``."""
        return np.asarray((XYZ_TO_LINEAR[:, :, np.newaxis] * self.matrix).sum(axis=1))

    def __call__(self, signal: Array) -> Array:
        """Convert coordinates (n, 4) to XYZ (n, 3)."""
        return transform(self.matrix, signal)


def matrices_of(xyY: Array, selection: str) -> Matrices:
    """Return the matrices of a selection for the tips ``xyY``, (4, 3)."""
    three_point = three_point_matrices(xyY_to_xyz(xyY))
    chosen = averaged_matrices(three_point) if selection == "nearest" else three_point
    return Matrices(tuple(tuple(tuple(float(v) for v in row) for row in matrix) for matrix in chosen))


def paper_links(aged: AgedDisplay) -> tuple[Selection, Matrices] | None:
    """Return selection and emission of a display whose chain is exactly the paper's; None for any other display."""
    match aged.head, aged.tail:
        case (SrgbTransfer(), Selection() as selection), (Matrices() as emission,):
            return selection, emission
    return None


def selects_nearest(aged: AgedDisplay) -> bool:
    """Whether the chain is exactly the paper's, and jumps at white's border."""
    paper = paper_links(aged)
    return paper is not None and paper[0].name == "nearest"


def tip_shares(
    linear: Array, code: Array, selection: str, weights: Array | None = None, grey: Array | None = None
) -> Array:
    """Return the share of each tip, (n, 4), for linear light (n, 3): the closed form of the paper's emission.

    With D = W − R − G − B: ``continuous`` gives Σ l_c P_c + D·(smallest channel), ``nearest`` gives Σ l_c P_c + ⅓D·(Σ l
    − Σ_i w_i l_i), where w_i is the share of primary i's matrix. ``weights``: shares of ``nearest``, (n, 4), if known.
    ``grey``: replacement of the smallest channel, (n,); None: the smallest channel.
    """
    if selection == "nearest":
        weights = nearest_weights(code_to_linear(code)) if weights is None else weights
    else:
        weights = continuous_weights(linear)
    # By channels, because NumPy's sum along a short last axis is many times slower.
    red, green, blue = np.moveaxis(linear, -1, 0)
    _, *(of_red, of_green, of_blue) = weights.T
    extra = of_red * red + of_green * green + of_blue * blue
    if selection == "nearest":
        extra = (red + green + blue - extra) / 3.0
    if grey is not None:
        extra = grey
    return np.stack([extra, red - extra, green - extra, blue - extra], axis=-1)
