"""``cohort``: lifetimes of many slides, on this machine's cores or on a Dask cluster, and over all of them."""

from __future__ import annotations

from lutgen.pictures.cohort.run import BrokenSlide, Cohort, cohort

__all__ = ["BrokenSlide", "Cohort", "cohort"]
