"""Whether the installed OpenColorIO, which reads these formats strictly, reads the file at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.bake.lint.clf import ClfScan
from lutgen.bake.lint.finding import OCIO, OCIO_21, Finding, refused
from lutgen.bake.lint.rules.clf_form import in_smptes_namespace
from lutgen.bindings import ocio

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.bake.lint.table import TableScan

KINDS = ("clf", "lut", "3dl")


def check(scan: ClfScan | TableScan) -> Iterator[Finding]:
    """2.1 and 2.6 agree on these formats but for what other rules say; so the installed one speaks for both."""
    if scan.refusal:
        how = f"OpenColorIO {ocio().__version__} was asked"
        without_id = isinstance(scan, ClfScan) and in_smptes_namespace(scan) and "id" not in scan.root
        fates = refused(*([OCIO_21] if without_id else OCIO), how=how)
        yield Finding(f"is not read: {scan.refusal}", "Export it again.", 0, fates)
    elif scan.refusal is None and not (scan.broken if isinstance(scan, ClfScan) else scan.unclosed):
        fates = refused(*OCIO, how="takes 129 points an axis at most")
        yield Finding("is too large to be given to OpenColorIO", "Resample it to 65 or 33.", 0, fates)
