"""From the plan to the readings: code values → channels' light → spectra → room light → XYZ."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.aging import primaries
from tests.generators.spectral.emission import EMISSION
from tests.generators.spectral.laws import generator, srgb_to_linear
from tests.generators.spectral.outside import LIGHT, PIXELS
from tests.generators.spectral.pixels import CODES, MIXING
from tests.generators.spectral.scene import Scene
from tests.generators.spectral.spectra import xyz
from tests.generators.spectral.viewing import INSTRUMENT, ROOM

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from tests.generators.spectral.displays import Panel
    from tests.generators.spectral.plan import Plan
    from tests.generators.spectral.scene import Effect


def readings(panel: Panel, plan: Plan, hidden: Mapping[str, float], seed: int) -> NDArray[np.float64]:
    """Return XYZ at the instrument (n, 3), cd/m², without noise."""

    def through(stage: Mapping[str, Effect], values: NDArray[np.float64], scene: Scene) -> NDArray[np.float64]:
        for name, effect in stage.items():
            if name in hidden:
                values = effect(values, scene, hidden[name], generator(seed, name))
        return values

    aged = primaries(panel, plan.hours, hidden, seed)[plan.hour]
    scene = Scene(panel=panel, plan=plan, primaries=aged, linear=srgb_to_linear(plan.drive))
    scene = replace(scene, linear=srgb_to_linear(through(CODES, plan.drive, scene)))
    scene = replace(scene, linear=through(MIXING, scene.linear, scene))
    scene = replace(scene, linear=through(PIXELS, scene.linear, scene))
    spectra = np.einsum("nc,ncl->nl", scene.linear, aged)
    spectra = through(EMISSION, spectra, scene)
    spectra = through(LIGHT, spectra, scene)
    spectra = through(ROOM, spectra, scene)
    capped = np.array([note == "lens cap" for note in plan.note])
    return through(INSTRUMENT, np.where(capped[:, None], 0.0, xyz(spectra)), scene)
