"""``DisplayModel``: a measured display and the model of its aging. Gives an ``AgedDisplay`` for each mode and hour."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
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
from lutgen.display.tips import UNSAID, LuminanceLaw, Tips, law_of, luminance_law, scale_luminance
from lutgen.display.trace import SELECTION_STAGE, in_chain_order, is_soft
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import BASELINES, FORETELLING_BASELINES, MODES, NATIVE_BASELINES, REFERENCES, SELECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lutgen.colorimetry import Array
    from lutgen.display.chain import Link
    from lutgen.display.fitted import FitCovariance
    from lutgen.display.trace import Applied
    from lutgen.readings import Measurements

#: The display that is used when none is given: reconstructed, see its first line.
DEFAULT_DISPLAY = "reconstructed-ccfl"


@dataclass(frozen=True)
class DisplayModel:
    """A display: the paper's model of its tips, and the effects that the paper leaves out.

    Attributes
    ----------
    measurements
        The readings; their tips drive the model.
    reference, selection
        One of ``REFERENCES`` and of ``SELECTIONS``. Reference "": ``relative``, or ``absolute`` where readings of one
        session alone would make that the identity.
    luminance
        The law for ``chroma-luma``; not said: the display's own, or what its readings ask for. The display that lutgen
        brings asks for the paper's.
    effects
        What was found to act beside the paper's model; kept in the order of the light's way.
    latent
        The tips before the effects, as fitted; None: as measured.
    covariance
        How the errors of fitted parameters and latent tips hang together; None: not known. Of effects that are taken
        away it says nothing any more.
    baseline
        One of ``BASELINES``.
    held
        For baselines that foretell: whether a sensor holds white's luminance, so that by the law ``measured`` it stays
        as long as the sensor has a reserve.
    native
        For native baselines: the fresh display; None: as the readings of hour 0 have it.
    conditions
        Where and when the display is seen. Without effects nothing depends on them.
    verdict, fit
        How the model was found: a word, and texts and numbers for people.
    file
        The model file that it was loaded from; "" where there is none.

    """

    measurements: Measurements
    reference: str = ""
    selection: str = "nearest"
    luminance: LuminanceLaw = UNSAID
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
        """Refuse unknown names, tips that make no history, and an effect given twice."""
        if self.luminance == UNSAID:
            brought = self.measurements.file == str(default_display())
            object.__setattr__(self, "luminance", luminance_law("paper") if brought else law_of(self.measurements))
        if not self.reference:
            changes = np.unique(self.measurements.hours).size > 1
            object.__setattr__(self, "reference", "relative" if changes else "absolute")
        refuse_unknown("reference", self.reference, REFERENCES)
        refuse_unknown("selection", self.selection, SELECTIONS)
        refuse_unknown("baseline", self.baseline, BASELINES)
        if self.native and self.baseline not in NATIVE_BASELINES:
            raise LutgenError(f"baseline {self.baseline!r} has no native display. Take the baseline native.")
        effects = tuple(in_chain_order(self.effects))
        names = [each.effect.name for each in effects]
        twice = first_doubled(names)
        if twice:
            raise LutgenError(f"effect {twice!r} is given twice. Keep one of them.")
        object.__setattr__(self, "effects", effects)
        if self.baseline in NATIVE_BASELINES and self.native is None:
            object.__setattr__(self, "native", NativeDisplay.of(self.measurements))
        told, readings = self.baseline not in FORETELLING_BASELINES, self.measurements
        known = LoadedCalibrations.of(readings, told=told) if self.baseline in NATIVE_BASELINES else ()
        object.__setattr__(self, "_known", known)
        object.__setattr__(self, "_tips", self._measured_tips())
        object.__setattr__(self, "_before", self._tips_before_effects())

    @property
    def tips(self) -> Tips:
        """White and primaries over time, as measured; for baselines that foretell those of hour 0."""
        tips: Tips = self.__dict__["_tips"]
        return tips

    @property
    def tips_before_effects(self) -> Tips:
        """White and primaries over time of the display before its effects, as fitted, or as measured."""
        tips: Tips = self.__dict__["_before"]
        return tips

    @property
    def known(self) -> tuple[LoadedCalibrations, ...]:
        """Calibrations that files of later sessions hold, for native baselines: a change that is no finding."""
        known: tuple[LoadedCalibrations, ...] = self.__dict__["_known"]
        return known

    @property
    def baked(self) -> tuple[AppliedEffect, ...]:
        """The effects that a LUT shows: those of the instrument belong to no display."""
        return tuple(each for each in self.effects if each.effect.stage != "instrument")

    @property
    def fitted(self) -> frozenset[tuple[str, str]]:
        """Effect and name of the parameters that were fitted."""
        return frozenset((each.effect.name, name) for each in self.effects for name in each.free)

    @property
    def fitted_hours(self) -> int:
        """Number of hours whose tips were fitted: hour 0 alone for baselines that foretell."""
        if self.latent is None:
            return 0
        return 1 if self.baseline in FORETELLING_BASELINES else int(self.latent.hours.size)

    def at(self, mode: str, hours: float) -> AgedDisplay:
        """Return the display of ``mode`` at ``hours``, under the model's conditions.

        Effects that do not age, such as a leak that was there from the first hour, show at hour 0 too: with them hour 0
        is no identity, and ``stable`` is the un-aged display with its leak. Under the baseline ``native`` what the
        first session showed is none of them: ``relative`` puts on sRGB what has changed since, so that hour 0 is the
        identity; ``absolute`` is the native display itself.

        Raises
        ------
        LutgenError
            Unknown mode, hours outside the measured span or the luminance law's, or effects that give no light.

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
        head: tuple[Link, ...] = (SrgbTransfer(), Selection(self._chosen))
        return AgedDisplay(mode, float(hours), head, (emission,))

    def shown_tips(self, hours: float) -> Array:
        """Return xyY in cd/m² of white and primaries as they are seen, effects included, shape (4, 3).

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
        """The emission of ``mode`` at ``hours``: the four matrices that ``selection`` chooses from.

        Raises
        ------
        LutgenError
            The model has effects, or curves and black of its own: then four matrices do not describe it.

        """
        if self._acting or self._shown_native:
            raise LutgenError(
                "a display with effects, or curves of its own, is more than four matrices: ask its chain, "
                "at(mode, hours)."
            )
        (emission,) = (link for link in self.at(mode, hours).tail if isinstance(link, Matrices))
        return emission

    def names_of_steps(self) -> list[str]:
        """Name the effects that make stairs of the curves, by the last hour."""
        last = self._surroundings(float(self.tips.hours[-1]), self.reference)
        return [each.effect.name for each in self._acting if makes_steps(each, last)]

    @property
    def _shown_native(self) -> NativeDisplay | None:
        """The fresh display that is shown: ``relative`` shows sRGB instead, so that only changes are seen."""
        return self.native if self.reference == "absolute" else None

    def _chain(self, native: NativeDisplay | None) -> EffectChain:
        fresh = Fresh(self._chosen, native, told=self.baseline in NATIVE_BASELINES)
        return EffectChain(self._acting, self.conditions, fresh)

    @property
    def _acting(self) -> tuple[Applied, ...]:
        """The effects on the light; one that only asks for another selection is none of them."""
        chosen = (each for each in self.baked if each.effect.stage != SELECTION_STAGE or is_soft(each))
        return (*self.known, *chosen)

    @property
    def _chosen(self) -> str:
        asked = any(each.effect.stage == SELECTION_STAGE for each in self.baked)
        return "continuous" if asked else self.selection

    def _law(self, mode: str, hours: float, now: Surroundings) -> Callable[[float], float]:
        """White's luminance in a mode, relative to hour 0, from that by the effects alone."""
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

    def _measured_tips(self) -> Tips:
        if self.baseline in FORETELLING_BASELINES:
            readings = self.measurements
            return constant_tips(np.unique(readings.hours), readings.tips()[1][0], readings.file)
        return Tips.of(self.measurements)

    def _tips_before_effects(self) -> Tips:
        if self.latent is None:
            return self.tips
        if self.baseline in FORETELLING_BASELINES:
            fresh = xyz_to_xyY(self.latent.xyz_cd_m2[0])
            return constant_tips(self.tips.hours, fresh, self.measurements.file)
        return self.latent.over_time(self.measurements.file)


def hour_name(hours: float) -> str:
    """Name an hour as folders and context variables do: 10000h, 562.5h."""
    return f"{hours:.6f}".rstrip("0").rstrip(".") + "h"


def default_display() -> Path:
    """Path of the default display's measurements, in an installed package or in a clone."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "configs", package.parent / "configs"):
        path = folder / "displays" / f"{DEFAULT_DISPLAY}.csv"
        if path.is_file():
            return path
    message = f"the default display {DEFAULT_DISPLAY}.csv is missing here. Reinstall lutgen, or give --display FILE."
    raise LutgenError(message)
