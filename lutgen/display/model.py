"""``DisplayModel``: a measured display and the model of its aging, with an ``AgedDisplay`` for each mode and hour."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.cells import first_doubled
from lutgen.colorimetry import xyY_to_xyz, xyz_to_xyY
from lutgen.display.chain import AgedDisplay, SrgbTransfer
from lutgen.display.conditions import REFERENCE, Conditions
from lutgen.display.effect_chain import EffectChain, Fresh, Surroundings, four_tips, makes_steps
from lutgen.display.fitted import AppliedEffect, LatentTips, constant_tips
from lutgen.display.loaded import LoadedCalibrations
from lutgen.display.native import NativeDisplay
from lutgen.display.paper import Matrices, Selection, matrices_of
from lutgen.display.tips import UNSTATED, LuminanceLaw, Tips, law_of, luminance_law, scale_luminance
from lutgen.display.trace import SELECTION_STAGE, in_chain_order, is_soft
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import BASELINES, FORETELLING_BASELINES, MODES, NATIVE_BASELINES, REFERENCES, SELECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lutgen.colorimetry import Array
    from lutgen.display.fitted import FitCovariance
    from lutgen.display.trace import Applied
    from lutgen.readings import Measurements

#: Name of the default display: reconstructed; see the first line of its file.
DEFAULT_DISPLAY = "reconstructed-ccfl"


@dataclass(frozen=True)
class DisplayModel:
    """A display: the paper's model of its white and primaries, and effects that the paper does not model.

    Attributes
    ----------
    measurements
        The readings, whose white and primaries are the input of the model.
    reference, selection
        One of ``REFERENCES`` and one of ``SELECTIONS``. Reference "" means ``relative``, or ``absolute`` for readings
        of one session, for which ``relative`` would be the identity.
    luminance
        The luminance law for ``chroma-luma``. Default: the law that the readings state, otherwise ``measured``. The
        default display has the law ``paper``.
    effects
        Effects in addition to the paper's model, sorted in chain order.
    latent
        White and primaries before the effects, as fitted; None: as measured.
    covariance
        Covariance of the fitted parameters and of ``latent``; None: not known. Parameters of effects that were removed
        from the model are ignored.
    baseline
        One of ``BASELINES``.
    held
        For baselines that predict later hours: whether a sensor holds white's luminance. With the law ``measured``
        white's luminance then stays constant as long as the sensor has a reserve.
    native
        For native baselines: the fresh display; None: the native display of the readings at hour 0.
    conditions
        Conditions under which the display is seen. They have an influence only with effects.
    verdict, fit
        Result of the fit: a word, and texts and numbers for people.
    file
        The model file of the model; "": not loaded from a file.

    """

    measurements: Measurements
    reference: str = ""
    selection: str = "nearest"
    luminance: LuminanceLaw = UNSTATED
    effects: tuple[AppliedEffect, ...] = ()
    latent: LatentTips | None = None
    covariance: FitCovariance | None = None
    baseline: str = "colour-points"
    held: bool = False
    native: NativeDisplay | None = None
    conditions: Conditions = REFERENCE
    verdict: str = ""
    fit: Mapping[str, str | float] = field(default_factory=dict)
    file: str = ""

    def __post_init__(self) -> None:
        if self.luminance == UNSTATED:
            is_default = self.measurements.file == str(default_display())
            object.__setattr__(self, "luminance", luminance_law("paper") if is_default else law_of(self.measurements))
        if not self.reference:
            changes = np.unique(self.measurements.hours).size > 1
            object.__setattr__(self, "reference", "relative" if changes else "absolute")
        refuse_unknown("reference", self.reference, REFERENCES)
        refuse_unknown("selection", self.selection, SELECTIONS)
        refuse_unknown("baseline", self.baseline, BASELINES)
        if self.native and self.baseline not in NATIVE_BASELINES:
            raise LutgenError(f"baseline {self.baseline!r} has no native display. Take the baseline native.")
        effects = tuple(in_chain_order(self.effects))
        if twice := first_doubled(each.effect.name for each in effects):
            raise LutgenError(f"effect {twice!r} is given twice. Keep one of them.")
        object.__setattr__(self, "effects", effects)
        if self.baseline in NATIVE_BASELINES and self.native is None:
            object.__setattr__(self, "native", NativeDisplay.of(self.measurements))
        _ = self._known, self._tips, self._before  # computed here, because they raise LutgenError

    @property
    def tips(self) -> Tips:
        """Measured white and primaries over time; constant for baselines that predict later hours from hour 0."""
        return self._tips

    @property
    def tips_before_effects(self) -> Tips:
        """White and primaries over time before the effects: fitted, otherwise measured."""
        return self._before

    @property
    def known(self) -> tuple[LoadedCalibrations, ...]:
        """Changes by calibrations that files of later sessions hold, for native baselines; known, not fitted."""
        return self._known

    @property
    def baked(self) -> tuple[AppliedEffect, ...]:
        """The effects that a LUT shows: all except effects of the instrument."""
        return tuple(each for each in self.effects if each.effect.stage != "instrument")

    @property
    def fitted(self) -> frozenset[tuple[str, str]]:
        """Effect and name of each fitted parameter."""
        return frozenset((each.effect.name, name) for each in self.effects for name in each.free)

    @property
    def fitted_hours(self) -> int:
        """Number of hours with fitted white and primaries; 1 for baselines that predict later hours from hour 0."""
        if self.latent is None:
            return 0
        return 1 if self.baseline in FORETELLING_BASELINES else int(self.latent.hours.size)

    def at(self, mode: str, hours: float) -> AgedDisplay:
        """Return the display of ``mode`` at ``hours``, under the model's conditions.

        Effects that exist from the first hour, such as a light leak, show at hour 0 too. With such effects hour 0 is
        not the identity, and ``stable`` is the un-aged display with this leak. Under the baseline ``native`` the fresh
        display contains the effects of the first session: ``relative`` applies the changes since then to sRGB, so that
        hour 0 is the identity; ``absolute`` is the native display itself.

        Raises
        ------
        LutgenError
            Unknown mode, hours outside the span of the measurements or of the luminance law, or effects that give no
            light.

        """
        refuse_unknown("mode", mode, MODES)
        self.tips.check_span(hours)
        when = 0.0 if mode == "stable" else float(hours)
        if self._acting or self._shown_native:
            chain, now = self._chain(self._shown_native), self._surroundings(when, self.reference)
            return chain.at(mode, float(hours), now, self._law(mode, hours, now))
        tips = self.tips_before_effects
        factor = self.luminance.factor(hours, tips) if mode == "chroma-luma" else 1.0
        emission = matrices_of(scale_luminance(tips.referenced(when, self.reference), factor), self._chosen)
        return AgedDisplay(mode, float(hours), (SrgbTransfer(), Selection(self._chosen)), (emission,))

    def shown_tips(self, hours: float) -> Array:
        """Return xyY in cd/m² of white and primaries with effects, under the model's conditions, (4, 3).

        Raises
        ------
        LutgenError
            Hours outside the measured span, or effects that give no light.

        """
        if not self._acting:
            return self.tips_before_effects.at(hours)
        self.tips.check_span(hours)
        return xyz_to_xyY(self._chain(self.native).tips(self._surroundings(float(hours), "absolute")))

    def matrices(self, mode: str, hours: float) -> Matrices:
        """Return the emission of ``mode`` at ``hours``: the four matrices from which ``selection`` chooses.

        Raises
        ------
        LutgenError
            The model has effects, or its own curves and black, which four matrices do not describe.

        """
        if self._acting or self._shown_native:
            raise LutgenError(
                "four matrices do not describe a display with effects or with its own curves. Use at(mode, hours), "
                "which returns its whole chain."
            )
        (emission,) = (link for link in self.at(mode, hours).tail if isinstance(link, Matrices))
        return emission

    def names_of_steps(self) -> list[str]:
        """Return the names of the effects that turn curves into staircases at the last hour."""
        last = self._surroundings(float(self.tips.hours[-1]), self.reference)
        return [each.effect.name for each in self._acting if makes_steps(each, last)]

    @property
    def _shown_native(self) -> NativeDisplay | None:
        """The native fresh display that is shown; None for ``relative``, which shows the changes on sRGB."""
        return self.native if self.reference == "absolute" else None

    def _chain(self, native: NativeDisplay | None) -> EffectChain:
        fresh = Fresh(self._chosen, native, contains_effects=self.baseline in NATIVE_BASELINES)
        return EffectChain(self._acting, self.conditions, fresh)

    @property
    def _acting(self) -> tuple[Applied, ...]:
        """Known calibrations and the effects that a LUT shows, except an effect that only selects ``continuous``."""
        chosen = (each for each in self.baked if each.effect.stage != SELECTION_STAGE or is_soft(each))
        return (*self.known, *chosen)

    @property
    def _chosen(self) -> str:
        switched = any(each.effect.stage == SELECTION_STAGE for each in self.baked)
        return "continuous" if switched else self.selection

    def _law(self, mode: str, hours: float, now: Surroundings) -> Callable[[float], float]:
        """Return a function from white's luminance with the effects alone to white's luminance in the mode.

        Both luminances are relative to hour 0.
        """
        if mode != "chroma-luma":
            return lambda _measured: 1.0
        if self.luminance.table:
            factor = self.luminance.factor(hours, self.tips)
            return lambda _measured: factor
        if self.held and self.baseline in FORETELLING_BASELINES:
            beyond = tuple(each for each in self._acting if not each.effect.compensated)
            held = replace(self._chain(self._shown_native), applied=beyond).dimming(now) if beyond else 1.0
            return lambda _measured: held
        return lambda measured: measured

    def _surroundings(self, hours: float, reference: str) -> Surroundings:
        tips = self.tips_before_effects
        white = float(tips.xyY[0, 0, 2])
        now, fresh = (xyY_to_xyz(tips.referenced(hour, reference)) * white for hour in (hours, 0.0))
        kind = self.measurements.metadata.get("display", "")
        return Surroundings(hours, four_tips(now), four_tips(fresh), kind)

    @cached_property
    def _known(self) -> tuple[LoadedCalibrations, ...]:
        if self.baseline not in NATIVE_BASELINES:
            return ()
        return LoadedCalibrations.of(self.measurements, measured_tips=self.baseline not in FORETELLING_BASELINES)

    @cached_property
    def _tips(self) -> Tips:
        if self.baseline in FORETELLING_BASELINES:
            readings = self.measurements
            return constant_tips(np.unique(readings.hours), readings.tips()[1][0], readings.file)
        return Tips.of(self.measurements)

    @cached_property
    def _before(self) -> Tips:
        if self.latent is None:
            return self.tips
        if self.baseline in FORETELLING_BASELINES:
            fresh = xyz_to_xyY(self.latent.xyz_cd_m2[0])
            return constant_tips(self.tips.hours, fresh, self.measurements.file)
        return self.latent.over_time(self.measurements.file)


def hour_name(hours: float) -> str:
    """Return an hour's name in folders and context variables: 10000h, 562.5h."""
    return f"{hours:.6f}".rstrip("0").rstrip(".") + "h"


def default_display() -> Path:
    """Return the path of the default display's measurements, in an installed package or in a clone."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "configs", package.parent / "configs"):
        path = folder / "displays" / f"{DEFAULT_DISPLAY}.csv"
        if path.is_file():
            return path
    message = f"the default display {DEFAULT_DISPLAY}.csv is missing here. Reinstall lutgen, or give --display FILE."
    raise LutgenError(message)
