"""The object in the showing process: the model for tables, and the colours of the image for measurements."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.bake.lut import SIZES, Sampler
from lutgen.bake.plan import display_to_bake
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.explore.opened import Opened
from lutgen.explore.process import Hosted
from lutgen.names import AGING_MODES

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay, DisplayModel
    from lutgen.pictures.difference import DifferenceCurve
    from lutgen.pictures.distinct import Colours


@dataclass
class ShownModel:
    """A model and its cached results."""

    model: DisplayModel
    sampler: Sampler = field(default_factory=Sampler)
    corrections: Sampler = field(default_factory=Sampler)
    curves: dict[str, DifferenceCurve] = field(default_factory=dict)


class Showing(Hosted):
    """A model and colours. The window calls its methods."""

    #: Measuring an image and searching for a correction are slow: tables must not wait for these methods.
    concurrent = frozenset({"difference", "compensated"})

    def __init__(self, tell: Callable[..., None]) -> None:
        """Begin without model and colours."""
        super().__init__(tell)
        self._with: ShownModel | None = None
        self._without: ShownModel | None = None
        self._colours: Colours | None = None
        self._first: dict[str, Any] = {}

    def idle(self) -> bool:
        """Bake the first table of the page while the browser starts, so that the page gets the table at once."""
        first, self._first = self._first, {}
        if first:
            self.aged(**first)
        return False

    def open(self, *, data: str, baseline: str | None, model: str | None) -> dict[str, Any]:
        """Show readings or a saved model, before any fit."""
        opened = Opened(data, baseline, model)
        self._with = self._without = ShownModel(opened.fresh)
        overview = opened.overview()
        self._first = overview["first"]
        return overview

    def show(self, body: bytes, *, without: bool = False) -> dict[str, Any]:
        """Show another model; ``without``: a model without effects, which is shown until a model with effects comes."""
        self._with = ShownModel(pickle.loads(body))  # noqa: S301 - the other process's
        if without:
            self._without = self._with
        return {}

    def _shown(self, *, without: bool) -> ShownModel:
        shown = self._without if without else self._with
        if shown is None:
            raise LutgenError("no readings are open. Drop a table of readings (.csv) first.")
        return shown

    def aged(self, mode: str, hours: float, size: int, *, differences: bool = False, without: bool = False) -> bytes:
        """Return the table that ``lutgen build --format cube`` writes, in 16 bits (:mod:`lutgen.pictures.viewer`).

        ``without``: the table of the model without the effects that are switched on.
        """
        from lutgen.pictures.viewer import viewer_table

        of = self._shown(without=without)
        display, pair = of.model.at(mode, hours), None
        shown = _baked(of.sampler, display, size)
        if differences:
            fresh = _baked(of.sampler, of.model.at("stable", hours), size, whole=True)
            pair = (fresh, _baked(of.sampler, display, size, whole=True))
        return viewer_table(shown, pair).tobytes()

    def compensated(
        self, mode: str, hours: float, size: int, *, differences: bool = False, without: bool = False
    ) -> bytes:
        """Return a table as :meth:`aged`, for the signal that ``build --direction compensate`` has corrected."""
        from lutgen.pictures.viewer import viewer_table

        of = self._shown(without=without)
        drive = _baked(of.corrections, display_to_bake(of.model, mode, hours, direction="compensate"), size)
        shown, pair = of.model.at(mode, hours).code_to_code(drive), None
        if differences:
            pair = (_baked(of.corrections, of.model.at("stable", hours), size, whole=True), shown)
        return viewer_table(shown, pair).tobytes()

    def colours(self, path: str) -> dict[str, Any]:
        """Load the colours of another image, which the imaging process has counted."""
        self._colours = pickle.loads(Path(path).read_bytes())  # noqa: S301 - our own file
        for each in (self._with, self._without):
            if each:
                each.curves = {}
        return {}

    def difference(self, mode: str, hours: float, *, without: bool = False) -> dict[str, float | None]:
        """Return ΔE2000 of the whole image at an hour, and the hours until it reaches 3 and 5 (``lutgen lifetime``)."""
        from lutgen.pictures.blocks import few_threads
        from lutgen.pictures.difference import curves_of
        from lutgen.pictures.lifetime import TOLERANCES, curve_hours, hours_from_0

        refuse_unknown("mode", mode, AGING_MODES)
        shown, colours = self._shown(without=without), self._colours
        model, curves = shown.model, shown.curves
        if colours is None:
            return dict.fromkeys(("mean", "mean_2sd", "hours_to_3", "hours_to_5"))
        with few_threads(1):
            now = curves_of(colours, model, [mode], [hours])[mode]
            if mode not in curves:
                between = curve_hours(model, hours_from_0(model, [mode], None))
                curves[mode] = curves_of(colours, model, [mode], between)[mode]
        until = {f"hours_to_{each:g}": curves[mode].hours_until("mean", each) for each in TOLERANCES}
        return {"mean": float(now.mean[0]), "mean_2sd": float(now.max[0]), **until}


def _baked(sampler: Sampler, display: AgedDisplay, size: int, *, whole: bool = False) -> Array:
    """Return a baked table of code values, (size³, 3)."""
    refuse_unknown("size", size, SIZES)
    return sampler.lut(display, size, "code", clip=True, whole=whole).table.reshape(-1, 3)
