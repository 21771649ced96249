"""Nodes of a clipped table, fitted to the model beside the clip.

Where the model reaches the viewer's full code value between two nodes, the line between the clipped nodes cuts the
corner: by up to two codes of 255 at 33³, in the pale background of slides. Two things mend most of that:

- A node beyond the clip keeps what it has above 1, up to ``HEADROOM``; readers clip after they interpolate.
- The last node before the clip is raised by what least squares ask for: the errors of the cell that bends, and of the
  cell before it, on the line along the channel's own axis, at ``PLACES`` regular places. Along that axis the clip
  is met; the two other channels hardly change a channel.

Per node one number is solved for in closed form, so the same display gives the same bytes everywhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Largest number of a table in text: less than one code of 8 bits above white. Readers make bytes of tables, and some
#: (three.js) do not clip first: 256 of 255 would be black.
HEADROOM = 1.0038

#: Places between two nodes at which the line is compared with the model.
PLACES = (np.arange(8) + 0.5) / 8

#: Raising a node decides which places are clipped, and these decide how far it is raised: more rounds change nothing.
_ROUNDS = 4


def fitted_beside_clip(values: Array) -> Array:
    """Clip a table of code values to 0..``HEADROOM``, nodes beside the clip at 1 fitted.

    ``values``: unclipped, shape (n, n, n, 3), axes blue, green, red; so is what is returned.
    """
    table = np.clip(values, 0.0, HEADROOM)
    for channel in range(3):
        if values[..., channel].max() > 1.0:
            model, shown = (np.moveaxis(each[..., channel], 2 - channel, -1) for each in (values, table))
            beside = before_clip(model)
            before, beyond = model[..., :-1][beside], model[..., 1:][beside]
            shown[..., :-1][beside] += _raise(before, beyond, np.minimum(beyond, HEADROOM))
    return np.clip(table, 0.0, HEADROOM, out=table)


def before_clip(model: Array) -> NDArray[np.bool_]:
    """Which of the nodes (..., n) have the clip between themselves and the next, (..., n - 1)."""
    near, far = model[..., :-1], model[..., 1:]
    return np.asarray((near > 0.0) & (near < 1.0) & (far > 1.0))


def _raise(before: Array, beyond: Array, held: Array) -> Array:
    """By how much to raise the nodes before the clip, (n,): the model's values before and beyond it, the table's."""
    place = PLACES[:, np.newaxis]
    share = 1.0 - place
    straight = before + (held - before) * place
    wanted = np.minimum(before + (beyond - before) * place, 1.0)
    raised = np.zeros_like(before)
    for _ in range(_ROUNDS):
        counts = (straight + raised * share < 1.0) | (wanted < 1.0)
        lacking = np.where(counts, wanted - straight, 0.0)
        raised = (share * lacking).sum(axis=0) / ((share * share * counts).sum(axis=0) + (place * place).sum())
    return np.maximum(raised, 0.0)
