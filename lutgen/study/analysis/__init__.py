"""The analysis of a reader study: the paper's tables, and beside them what a statistician asks for.

``statistics`` and ``agreement`` hold the formulas, ``tables`` reads and writes CSV, the others make one part of the
analysis each. One more file holds one more part: a function from answers or counts to a frozen result.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from lutgen.errors import pick_one
from lutgen.names import INTERVALS
from lutgen.study.analysis.agreement import Kappa, condition_order, counts, kappas, pairs
from lutgen.study.analysis.further import FurtherAgreement, FurtherMeans, further_agreement, further_means
from lutgen.study.analysis.limits import design_limits, figure_limits
from lutgen.study.analysis.mixed import MISSING, MixedModel, available, mixed_models
from lutgen.study.analysis.paper_tables import (
    Agreement,
    AgreementTest,
    Corrected,
    Table2,
    corrected,
    samples,
    table_2,
    table_3,
    table_4,
)
from lutgen.study.answers import sensible

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.study.analysis.agreement import AgreementCounts
    from lutgen.study.analysis.statistics import StudySample
    from lutgen.study.answers import Answer

SCHEMA = 1


@dataclass(frozen=True)
class Analysis:
    """What was found.

    Attributes
    ----------
    sources
        Where the figures come from, in sentences; the first says so where they are simulated.
    ci
        How intervals of means are made, a key of ``INTERVALS``.
    samples
        Behind Table 2.
    table2, table3, table4
        As in the paper; empty where the figures for them are not known.
    means, agreement, kappas, mixed, holm
        Beyond the paper.
    limits
        What this design can and cannot show, in sentences.
    remarks
        What was left out, in sentences.

    """

    sources: tuple[str, ...]
    ci: str
    samples: tuple[StudySample, ...]
    table2: Table2
    table3: tuple[Agreement, ...]
    table4: tuple[AgreementTest, ...]
    means: tuple[FurtherMeans, ...]
    agreement: tuple[FurtherAgreement, ...]
    kappas: tuple[Kappa, ...]
    mixed: tuple[MixedModel, ...]
    holm: tuple[Corrected, ...]
    limits: tuple[str, ...]
    remarks: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: see ``lutgen/study/schema/analyse.json``."""
        content = asdict(self)
        del content["samples"]
        beyond = {name: content.pop(name) for name in ("means", "agreement", "kappas", "mixed", "holm")}
        return {"schema": SCHEMA, **content, "beyond": beyond}


def analyse_answers(
    answers: Sequence[Answer],
    *,
    conditions: Sequence[str] | None = None,
    sources: Sequence[str] = (),
    ci: str = "normal",
) -> Analysis:
    """Analyse the answers of a study.

    Parameters
    ----------
    answers
        At least one. Those whose time cannot be one are left out, and named in the remarks.
    conditions
        Their order; None: ``none``, then by mode and hour.
    sources
        Where the answers come from, in sentences.
    ci
        How intervals of means are made, a key of ``INTERVALS``.

    Raises
    ------
    LutgenError
        ``ci`` is unknown, or no answer has a time that can be one.

    """
    answers, left_out = sensible(answers)
    order = tuple(conditions or condition_order(answers))
    reading_pairs = pairs(answers)
    rows, measured = counts(order, reading_pairs), samples(order, answers)
    remarks = [] if rows else ["No image was read by a reader un-aged and once more: there is no agreement to tell of."]
    remarks += [] if available() else [MISSING]
    remarks += left_out
    return _analysis(
        measured,
        rows,
        ci=ci,
        sources=sources,
        agreement=further_agreement(rows, reading_pairs),
        kappa_rows=kappas(order, reading_pairs),
        mixed=mixed_models(order, answers, reading_pairs) if available() else (),
        limits=tuple(design_limits(order, answers, reading_pairs)),
        remarks=remarks,
    )


def analyse_figures(
    rows: Sequence[AgreementCounts], measured: Sequence[StudySample], *, sources: Sequence[str] = (), ci: str = "normal"
) -> Analysis:
    """Analyse figures that are already counted: agreement, and samples without values; either may be empty.

    Raises
    ------
    LutgenError
        ``ci`` is unknown.

    """
    remarks = ["Rank tests, paired tests, κ and mixed models need the answers themselves, not their figures."]
    return _analysis(
        measured,
        rows,
        ci=ci,
        sources=sources,
        agreement=further_agreement(rows),
        limits=tuple(design_limits((), (), ())),
        remarks=remarks,
    )


def _analysis(
    measured: Sequence[StudySample],
    rows: Sequence[AgreementCounts],
    *,
    ci: str,
    sources: Sequence[str],
    agreement: tuple[FurtherAgreement, ...],
    limits: tuple[str, ...],
    remarks: Sequence[str],
    kappa_rows: tuple[Kappa, ...] = (),
    mixed: tuple[MixedModel, ...] = (),
) -> Analysis:
    if ci not in INTERVALS:
        raise pick_one("interval", ci, INTERVALS)
    second, fourth = table_2(measured, ci=ci), table_4(rows)
    several = corrected(second.tests, fourth)
    return Analysis(
        sources=tuple(sources),
        ci=ci,
        samples=tuple(measured),
        table2=second,
        table3=table_3(rows),
        table4=fourth,
        means=further_means(measured),
        agreement=agreement,
        kappas=kappa_rows,
        mixed=mixed,
        holm=several,
        limits=(*limits, *figure_limits(rows, fourth, agreement, several)),
        remarks=tuple(remarks),
    )
