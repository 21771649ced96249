"""Fitting of table nodes to the model beside the clip and beside the jump at white.

The clip: the model reaches the viewer's full code value between two nodes. A straight line between the clipped nodes
is too dark at this bend, by up to two codes of 255 at 33³. The pale background of slides is affected.

- A node beyond the clip keeps its value above 1, up to ``HEADROOM``. Readers clip after they interpolate. Integer files
  cannot store values above 1.
- The last node before the clip is raised until its own error equals the error of the line at the bend, by at most half
  a code. The line along the channel's own axis is used, since the other two axes hardly change the channel.

The jump: the paper's ``nearest`` jumps at white's border, and a table replaces the step by a ramp. The side of a colour
depends on its code values only. The ramps that fit the step best, by least squares, are therefore computed once for all
hours (``ramps_at_white``): for each node of a cell with corners on both sides, the share of the jump by which the node
moves. A node moves by at most half a code.

All sums have a fixed order, and the iteration has few rounds, so that the same display gives the same bytes everywhere.
"""

from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.spaces import SPACES, lattice, tetrahedra
from lutgen.colorimetry import Array, code_to_linear
from lutgen.display.paper import nearest_weights

#: Largest number of a text table: less than one 8-bit code above white. Some readers (three.js) convert tables to bytes
#: without clipping. A code of 256 would become black.
HEADROOM = 1.0039

#: The largest change of a node, half a code: the fit of one cell must not spoil the neighbouring cells.
LARGEST_MOVE = 0.5 / 255

#: Number of places along each edge of a cell at which ramps are compared with the step; number of rounds and relaxation
#: factor of the Jacobi iteration.
_PLACES, _ROUNDS, _RELAXATION = 3, 4, 1.5


def fit_beside_clip(table: Array, top: float = HEADROOM) -> None:
    """Clip a table of unclipped code values to 0..``top`` in place, and fit the nodes beside the clip at 1.

    The table has shape (n, n, n, 3) and axes blue, green, red. It is a view of contiguous rows or columns.
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
    """Return the flat indices of nodes for which the clip lies before the next node along the channel's own axis.

    ``own``: the unclipped values of the channel at the nodes of a lattice, red fastest, (n³,).
    """
    step = size**channel
    beyond = np.flatnonzero(own > 1.0) if own.max() > 1.0 else np.zeros(0, np.intp)
    if not beyond.size:
        return beyond
    before = beyond[beyond // step % size > 0] - step
    near = own[before]
    return np.asarray(before[(near > 0.0) & (near < 1.0)])


def _raise(before: Array, beyond: Array, held: Array) -> Array:
    """Return by how much to raise the nodes before the clip, (n,).

    ``before`` and ``beyond`` are the values before and beyond the clip. ``held`` are the stored values beyond it.
    """
    # A node that is raised by r is r too bright. The deficit at the bend shrinks by r times the weight of the node.
    bend = (1.0 - before) / (beyond - before)
    deficit = 1.0 - (before + (held - before) * bend)
    return np.clip(deficit / (2.0 - bend), 0.0, LARGEST_MOVE)


@cache
def ramps_at_white(space: str, size: int) -> tuple[NDArray[np.intp], Array]:
    """Return the nodes that are fitted beside white's border, and the share of the jump by which they move, (m,) each.

    The nodes are flat indices of a lattice in ``space``, red fastest. A positive share moves a node towards white.
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
    within = (np.arange(_PLACES) + 0.5) / _PLACES
    inside = np.array(list(product(within, repeat=3)))
    cells = np.argwhere(touched)[:, ::-1]
    code = SPACES[space].code((cells[:, np.newaxis] + inside).reshape(-1, 3) / (size - 1))
    nodes, weights = tetrahedra(code, space, size)
    step, ramp = _white(code), white.copy()
    share = np.bincount(nodes.T.ravel(), weights.T.ravel(), white.size)
    factor = np.where(moved.reshape(-1), _RELAXATION / np.maximum(share, 1.0), 0.0)
    for _ in range(_ROUNDS):
        residual = step - sum(weight * ramp[node] for node, weight in zip(nodes.T, weights.T, strict=True))
        ramp += factor * np.bincount(nodes.T.ravel(), (weights.T * residual).ravel(), white.size)
    chosen = np.flatnonzero(moved)
    return chosen, (ramp - white)[chosen]


def _white(code: Array) -> Array:
    """Return the weight of white's matrix for code values (n, 3), shape (n,)."""
    return nearest_weights(code_to_linear(code))[:, 0]
