"""The display as a chain of links from code value to the light that reaches the eye.

A link is a pure function of a signal, at one stage of the display. The signals between the stages are:

``drive`` code values · ``transfer`` → linear light per channel · ``mixing`` linear light per channel ·
``emission`` → XYZ · ``optics`` XYZ · ``viewing`` XYZ · ``instrument`` XYZ as a meter reports it.

Links that are the same at every hour come first and form the *head* of the chain. The head's result for a set of
colours is computed once and used for every hour and mode.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lutgen import effects
from lutgen.colorimetry import Array, code_to_linear, in_chunks, linear_to_code, transform, xyz_to_linear

#: Stages of the chain, with the names that effects use, in order.
STAGES = tuple(stage for stage in effects.STAGES if stage != "selection")


class Link(Protocol):
    """One step of the chain: a frozen dataclass. Two links are equal exactly when they compute the same."""

    def __call__(self, signal: Array) -> Array:
        """Return the signal after this link, for a signal of shape (n, k)."""


@dataclass(frozen=True)
class SrgbTransfer:
    """Code values to linear light by the sRGB curve, which does not age in the paper."""

    def __call__(self, signal: Array) -> Array:
        """(n, 3) code → (n, 3) linear."""
        return code_to_linear(signal)


@dataclass(frozen=True)
class AgedDisplay:
    """A display in one mode at one hour: the chain from code value to XYZ, and to a viewer's code value."""

    #: Mode and hour of the display.
    mode: str
    hours: float
    #: Links that do not depend on mode or hour. Aged displays with equal heads share their head signal.
    head: tuple[Link, ...]
    #: Links that depend on mode or hour.
    tail: tuple[Link, ...]

    def head_signal(self, code: Array) -> Array:
        """Return the signal after the head, (n, k), for code values (n, 3); equal for all displays with this head."""
        return _pass(self.head, code)

    def xyz(self, head_signal: Array) -> Array:
        """Return XYZ (n, 3), relative to the un-aged white, for the signal after the head (n, k)."""
        return _pass(self.tail, head_signal)

    def linear(self, head_signal: Array) -> Array:
        """Return linear sRGB of the aged colour (n, 3), unclipped, for the signal after the head (n, k)."""
        # If the last link is a matrix, its product with the conversion to linear sRGB is one matrix: faster.
        to_linear = getattr(self.tail[-1], "to_linear", None) if self.tail else None
        if to_linear is not None:
            return transform(to_linear, _pass(self.tail[:-1], head_signal))
        return xyz_to_linear(self.xyz(head_signal))

    def code_to_xyz(self, code: Array) -> Array:
        """Convert code values (..., 3) to XYZ of the aged display (..., 3), in chunks, in double precision."""
        return _of_triplets(lambda part: self.xyz(self.head_signal(part)), code)

    def code_to_linear(self, code: Array) -> Array:
        """Convert code values (..., 3) to linear sRGB of the aged colour (..., 3), without clipping."""
        return _of_triplets(lambda part: self.linear(self.head_signal(part)), code)

    def code_to_code(self, code: Array) -> Array:
        """Convert code values (..., 3) to code values with which an un-aged sRGB viewer shows the aged colour.

        Step 6 of the paper: XYZ → linear sRGB → clip to 0..1 → OETF.
        """
        return _of_triplets(lambda part: viewer_code(self.linear(self.head_signal(part))), code)

    def clipped_share(self, code: Array) -> float:
        """Return the share of ``code`` (..., 3) with aged colours outside the viewer's gamut, by more than 1e-6."""
        return float(np.mean(outside_gamut(self.code_to_linear(code))))


def viewer_code(linear: Array) -> Array:
    """Convert linear sRGB to code values of an un-aged sRGB viewer; clip to its gamut."""
    return linear_to_code(np.clip(linear, 0.0, 1.0))


def outside_gamut(linear: Array) -> NDArray[np.bool_]:
    """Return whether aged colours (..., 3) lie outside the viewer's gamut by more than 1e-6 of white, (...)."""
    red, green, blue = np.moveaxis((linear < -1e-6) | (linear > 1 + 1e-6), -1, 0)
    return np.asarray(red | green | blue)


def _pass(links: tuple[Link, ...], signal: Array) -> Array:
    return reduce(lambda passing, link: link(passing), links, signal)


def _of_triplets(function: Callable[[Array], Array], code: Array) -> Array:
    code = np.asarray(code, dtype=np.float64)
    return in_chunks(function, code.reshape(-1, 3)).reshape(code.shape)
