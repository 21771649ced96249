"""Nodes of a table where the display bends or jumps, fitted to the model.

Beside the clip: where the model reaches the viewer's full code value between two nodes, the line between the clipped
nodes cuts the corner, by up to two codes of 255 at 33³, in the pale background of slides.

- A node beyond the clip keeps what it has above 1, up to ``HEADROOM``; readers clip after they interpolate. Files of
  whole numbers have no room above 1.
- The last node before the clip is raised until it errs as much as the line does at the bend, by half a code at most:
  on the line along the channel's own axis, where the clip is met; the two other channels hardly change a channel.

Beside the jump of the paper's ``nearest`` at white's border: a table makes a ramp of the step. Which side a colour is
on depends on its code values alone, so the ramps that come nearest to the step, by least squares, are found once for
all hours (``ramps_at_white``): the share of the jump by which each node of a cell with corners on both sides is moved,
by half a code at most.

All sums are of fixed order, and of so few rounds, that the same display gives the same bytes everywhere.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.spaces import SPACES, lattice, tetrahedra
from lutgen.colorimetry import code_to_linear
from lutgen.display.paper import nearest_weights

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Largest number of a table in text: less than one code of 8 bits above white. Readers make bytes of tables, and some
#: (three.js) do not clip first: 256 of 255 would be black.
HEADROOM = 1.0039

#: The largest move of a node, half a code: a correction of one cell must not spoil the cells around it.
MOST_MOVED = 0.5 / 255

#: Places along each edge of a cell at which ramps are compared with the step; rounds and length of Jacobi's steps.
_PLACES_OF_STEP, _STEPS, _STEP = 3, 4, 1.5


def fit_beside_clip(table: Array, top: float = HEADROOM) -> None:
    """Clip a table of code values, unclipped, to 0..``top``, nodes beside the clip at 1 fitted; in place.

    Shape (n, n, n, 3), axes blue, green, red; a view of contiguous rows or columns.
    """
    size, values, raised = len(table), table.reshape(-1, 3), []
    for channel in range(3):
        own = values[:, channel]
        node = before_clip(own, channel, size)
        if not node.size:
            continue
        beyond = own[node + size**channel]
        raised.append((own, node, own[node] + _raise(own[node], beyond, np.minimum(beyond, top))))
    np.clip(values, 0.0, top, out=values)
    for own, node, value in raised:
        own[node] = np.minimum(value, top)


def before_clip(own: Array, channel: int, size: int) -> NDArray[np.intp]:
    """Find nodes with the clip between themselves and the next along a channel's own axis.

    The channel at each node of a lattice, unclipped, red fastest, (n³,) → flat indices.
    """
    step = size**channel
    beyond = np.flatnonzero(own > 1.0) if own.max() > 1.0 else np.zeros(0, np.intp)
    if not beyond.size:
        return beyond
    before = beyond[beyond // step % size > 0] - step
    near = own[before]
    return np.asarray(before[(near > 0.0) & (near < 1.0)])


def _raise(before: Array, beyond: Array, held: Array) -> Array:
    """Return by how much to raise the nodes before the clip, (n,): from values before and beyond it."""
    # Raised by r, a node is r too bright itself; where the model bends, the missing light shrinks by r times the node's
    # share.
    bend = (1.0 - before) / (beyond - before)
    lacking = 1.0 - (before + (held - before) * bend)
    return np.clip(lacking / (2.0 - bend), 0.0, MOST_MOVED)


@cache
def ramps_at_white(space: str, size: int) -> tuple[NDArray[np.intp], Array]:
    """Return the nodes that are fitted beside white's border, and the share of the jump by which they move, (m,) each.

    For a lattice in ``space``: flat indices, red fastest. Towards white is positive.
    """
    corners = [
        (slice(z, size - 1 + z), slice(y, size - 1 + y), slice(x, size - 1 + x))
        for z, y, x in product((0, 1), repeat=3)
    ]
    white = _white(lattice(size, space))
    cube = white.reshape(size, size, size)
    across = np.maximum.reduce([cube[each] for each in corners]) != np.minimum.reduce([cube[each] for each in corners])
    moved = np.zeros(cube.shape, dtype=bool)
    for each in corners:
        moved[each] |= across
    touched = np.logical_or.reduce([moved[each] for each in corners])
    within = (np.arange(_PLACES_OF_STEP) + 0.5) / _PLACES_OF_STEP
    inside = np.array(list(product(within, repeat=3)))
    cells = np.argwhere(touched)[:, ::-1]
    code = SPACES[space].code((cells[:, np.newaxis] + inside).reshape(-1, 3) / (size - 1))
    nodes, weights = tetrahedra(code, space, size)
    step, ramp = _white(code), white.copy()
    share = np.bincount(nodes.T.ravel(), weights.T.ravel(), white.size)
    factor = np.where(moved.reshape(-1), _STEP / np.maximum(share, 1.0), 0.0)
    for _ in range(_STEPS):
        left = step - sum(weight * ramp[node] for node, weight in zip(nodes.T, weights.T, strict=True))
        ramp += factor * np.bincount(nodes.T.ravel(), (weights.T * left).ravel(), white.size)
    chosen = np.flatnonzero(moved)
    return chosen, (ramp - white)[chosen]


def _white(code: Array) -> Array:
    """Share of white's matrix for code values (n, 3), (n,)."""
    return nearest_weights(code_to_linear(code))[:, 0]
