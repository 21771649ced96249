"""White, primaries and black of a session, a model of their changes between two sessions, and its evidence.

The light of a pixel is the sum of its channels and of the light that black leaks. Settings and aging dim this light,
the room adds light, and an instrument, whose correction is a matrix, converts the sum to XYZ::

    XYZ = matrix · (scale · (Σ gain_c · channel_c + leak) + added)

Settings of a channel do not change the leak; an aging backlight also dims the leak.

:func:`fit` fits the parameters of a change. Each parameter has a Gaussian prior, whose width is in ``PARAMETERS``. The
evidence of the change is Laplace's approximation about the best fit (MacKay 2003, Information Theory, Inference, and
Learning Algorithms, ch. 27). The evidence contains a penalty for every number that a cause needs: a matrix of nine
numbers is not preferred to one factor only because the matrix can fit more.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lutgen.colorimetry import Array
from lutgen.history.patches import CHANNELS, mean_xyz, tips
from lutgen.readings.session import Session

#: The order of the colour points, including black.
COLOURS = (*CHANNELS, "white", "black")

#: X and Z of room light over its Y: between tungsten and daylight (CIE 15: A 1.10 and 0.36, D65 0.95 and 1.09).
ROOM = np.array([1.0, 1.0, 0.7])

#: Parameter → (count of numbers, width of the prior). Widths are natural logarithms, except for ``added`` (Y of room
#: light, cd/m²), ``tint`` (deviation of X and Z of room light from ``ROOM``, cd/m²), ``matrix`` and ``gamut`` (shares).
#: ``scale``, ``gauge`` and ``step`` are factors of all light: by a setting, by the disagreement of two meters, and by
#: another correction of a meter. Meters agree within some percent; corrections move a primary by tens of percent.
#: ``gains`` and ``aged`` are factors of the channels; ``aged`` also dims the leak. ``yellowed`` changes light of short
#: wavelengths of all channels; ``faded`` changes X and Z of blue relative to its Y; ``gamut`` mixes channels.
PARAMETERS: dict[str, tuple[int, float]] = {
    "scale": (1, 0.7),
    "gauge": (1, 0.03),
    "step": (1, 0.25),
    "gains": (3, 0.25),
    "aged": (3, 0.45),
    "added": (1, 1.0),
    "tint": (2, 0.5),
    "matrix": (9, 0.10),
    "yellowed": (1, 0.10),
    "faded": (2, 0.15),
    "gamut": (9, 0.15),
}

#: X of short-wavelength light over its Z: x̄'s smaller peak over z̄'s peak (CIE 1931, 2°: 0.348 at 442 nm over 1.784).
SHORT = 0.195


@dataclass(frozen=True)
class ColourPoints:
    """White, the primaries and black of a session."""

    #: XYZ of red, green and blue at full drive, minus black, (3, 3).
    channels: Array
    #: White minus black and minus the sum of the channels, (3,): 0 for an additive display.
    extra: Array
    #: Black, (3,); zero if black was not read.
    leak: Array
    #: Whether black was read.
    has_black: bool

    @property
    def excess(self) -> float:
        """Luminance of ``extra`` over that of the sum of the channels."""
        return float(self.extra[1] / self.channels[:, 1].sum())

    def xyz(self) -> Array:
        """Return XYZ, as read, of red, green, blue, white and black, (5, 3)."""
        return _points(self.channels, self.extra, self.leak)

    def with_gains(self, gains: Array) -> "ColourPoints":
        """Return the colours with each channel's light multiplied by its gain; the leak does not change."""
        return replace(self, channels=self.channels * gains[..., np.newaxis], extra=self.extra * self.share_of(gains))

    def share_of(self, gains: Array) -> Array:
        """Return the factor of the light of the channels' sum by gains of the channels, (..., 3), as (..., 1)."""
        light = self.channels[:, 1]
        return np.asarray((gains * light).sum(axis=-1, keepdims=True) / light.sum())


def colour_points(session: Session, *, black_too: bool = True) -> ColourPoints | None:
    """Return the colour points of a session; None if white or a primary was not read, or has no light."""
    read = tips(session)
    white, black = mean_xyz(session, "white"), mean_xyz(session, "black") if black_too else None
    if white is None or len(read) < 3:
        return None
    leak = np.zeros(3) if black is None else np.asarray(black, dtype=np.float64)
    channels = np.vstack([*read.values()]) - leak
    if channels[:, 1].min() <= 0:
        return None
    return ColourPoints(channels, white - leak - channels.sum(axis=0), leak, black is not None)


def changed(before: ColourPoints, values: Mapping[str, Array]) -> Array:
    """Return XYZ of the colour points after a change, (..., 5, 3).

    ``values``: numbers of ``PARAMETERS``, (..., count) each; 0 is no change.
    """
    log_scale = sum((values[name] for name in ("scale", "gauge", "step") if name in values), np.zeros(1))
    gains, leak = np.exp(values.get("gains", np.zeros(3))), before.leak
    if "aged" in values:
        aged = np.exp(values["aged"])
        gains = gains * aged
        leak = leak * before.share_of(aged)
    lit = before.with_gains(gains)
    channels = lit.channels
    if "faded" in values:
        kept = np.ones((*values["faded"].shape[:-1], 3, 3))
        kept[..., 2, [0, 2]] = np.exp(values["faded"])
        channels = channels * kept
    if "gamut" in values:
        channels = channels + _square(values["gamut"]) @ channels
    xyz = np.exp(log_scale)[..., np.newaxis] * _points(channels, lit.extra, leak)
    if "yellowed" in values:
        lost = np.expm1(values["yellowed"]) * xyz[..., 2]
        xyz = xyz + np.stack([SHORT * lost, np.zeros_like(lost), lost], axis=-1)
    if "added" in values:
        tint = values.get("tint", np.zeros(2))
        sideways = np.stack([tint[..., 0], np.zeros(tint.shape[:-1]), tint[..., 1]], axis=-1)
        xyz = xyz + (values["added"] * ROOM + sideways)[..., np.newaxis, :]
    if "matrix" in values:
        xyz = xyz + xyz @ np.swapaxes(_square(values["matrix"]), -1, -2)
    return np.asarray(xyz)


def _points(channels: Array, extra: Array, leak: Array) -> Array:
    """Return XYZ (..., 5, 3) of red, green, blue, white and black."""
    leak = np.asarray(leak)[..., np.newaxis, :]
    white = channels.sum(axis=-2, keepdims=True) + extra[..., np.newaxis, :]
    shape = (*np.broadcast_shapes(channels.shape[:-2], leak.shape[:-2]), 1, 3)
    return np.concatenate([channels + leak, white + leak, np.broadcast_to(leak, shape)], axis=-2)


def _square(numbers: Array) -> Array:
    return numbers.reshape(*numbers.shape[:-1], 3, 3)


#: Differences between two sessions of an unchanged display, 1 σ: of all light together (temperature, place of the
#: meter), of the light of one channel, and of each number of a reading, as shares; and of each reading in cd/m². Two
#: real displays that were read twice on one day show differences of this size.
ALIKE, CHANNEL, READING, FLOOR_CD_M2 = 0.010, 0.006, 0.0025, 0.03

#: If white differs by this share from the sum of the primaries, the display adapts its brightness to the screen
#: content. The error of its light is then ``UNCERTAIN`` times that difference.
BY_CONTENT, UNCERTAIN = 0.04, 0.6

#: Error of a reading of black, 1 σ, as a share: black is a small number that instruments read badly.
BLACK = 0.04

_STEPS = 12

#: Step of a parameter for a numerical derivative.
NUDGE = 1e-5


@dataclass(frozen=True)
class ColourFit:
    """The best fit of a change."""

    #: Parameter → its numbers.
    values: dict[str, Array]
    #: χ² of the readings: fifteen numbers, or twelve without black.
    chi2: float
    #: Natural logarithm of the evidence, up to a constant that all fits of a pair share.
    evidence: float


def covariance(before: ColourPoints, after: Array, *, noise: float, loose: float = 0.0) -> Array:
    """Return the (15, 15) covariance of the readings ``after``, (5, 3), of an unchanged display.

    ``noise`` is the relative noise of a reading; ``loose`` is a further relative tolerance of white and primaries.
    """
    size = np.abs(after)
    share = np.array([READING] * 4 + [BLACK])[:, np.newaxis]
    variance = (share**2 + noise**2) * size**2 + FLOOR_CD_M2**2
    variance[:4] += loose**2 * size[:4] ** 2
    if not before.has_black:
        variance[4] = 1e9
    matrix = np.diag(variance.ravel())
    uncertain = UNCERTAIN * _by_content(before, after)
    common = (np.hypot(ALIKE, uncertain) * after).ravel()
    matrix += np.outer(common, common)
    total, own = after[:3].sum(axis=0), np.hypot(CHANNEL, uncertain)
    for channel in range(3):
        alone = np.zeros((5, 3))
        alone[channel] = own * after[channel]
        alone[3] = own * after[3] * np.abs(after[channel]) / np.maximum(total, 1e-9)
        matrix += np.outer(alone.ravel(), alone.ravel())
    return np.asarray(matrix)


def _by_content(before: ColourPoints, after: Array) -> float:
    """Return the share by which white differs from the sum of the primaries; 0 unless it differs in both sessions."""
    light = after[:4, 1] - after[4, 1]
    off = abs(float(light[3] / light[:3].sum()) - 1.0), abs(before.excess)
    return max(off) if min(off) >= BY_CONTENT else 0.0


def fit(before: ColourPoints, after: Array, free: Sequence[str], *, noise: float, loose: float = 0.0) -> ColourFit:
    """Fit the parameters ``free`` by Gauss-Newton steps; halve a step that increases the misfit."""
    counts = [PARAMETERS[name][0] for name in free]
    width = np.repeat([PARAMETERS[name][1] for name in free], counts).astype(np.float64)
    ends = np.cumsum(counts)
    places = {name: slice(end - count, end) for name, count, end in zip(free, counts, ends, strict=True)}
    spread = covariance(before, after, noise=noise, loose=loose)
    whitener = np.linalg.inv(np.linalg.cholesky(spread))

    def split(theta: Array) -> dict[str, Array]:
        return {name: theta[..., place] for name, place in places.items()}

    def residual(theta: Array) -> Array:
        misfit = after - changed(before, split(theta))
        whitened = misfit.reshape(*misfit.shape[:-2], 15) @ whitener.T
        return np.concatenate([whitened, theta / width], axis=-1)

    theta = np.zeros(width.size)
    here = residual(theta)
    slope = np.zeros((here.size, width.size))
    for _ in range(_STEPS if width.size else 0):
        # The derivative of the residuals by each parameter, (n, p), from one call for all parameters.
        slope = np.asarray((residual(theta + NUDGE * np.eye(theta.size)) - here).T / NUDGE)
        step = np.linalg.lstsq(slope, -here, rcond=None)[0]
        shrink = 1.0
        while shrink > 1e-3 and (there := residual(theta + shrink * step)) @ there > here @ here:
            shrink *= 0.5
        if shrink <= 1e-3:
            break
        theta, here = theta + shrink * step, there
        if float(np.abs(step).max()) < 1e-6:
            break
    chi2 = float(here[:15] @ here[:15])
    # Occam's factor: for each parameter, the width of the posterior over the width of the prior.
    curved = slope[:15] * width
    occam = float(np.linalg.slogdet(np.eye(width.size) + curved.T @ curved)[1])
    # Ratio of the covariance's determinants with and without ``loose``: a wider tolerance lowers the evidence.
    plain = np.linalg.slogdet(covariance(before, after, noise=noise))[1]
    evidence = -0.5 * (float(here @ here) + occam + float(np.linalg.slogdet(spread)[1] - plain))
    return ColourFit(split(theta), chi2, evidence)
