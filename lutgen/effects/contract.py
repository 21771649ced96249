"""Whether an effect keeps the contract, built-in or anybody's own; a user's is tried in a process of its own.

What the contract holds is in :mod:`lutgen.effects.clauses`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.effects.child import LIMIT_S, Answers, ask
from lutgen.effects.clauses import CLAUSES, Clause, examine
from lutgen.errors import LutgenError, pick_one

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from lutgen.effects.declare import Effect


@dataclass(frozen=True)
class Report:
    """What trying the contract of an effect gave, clause by clause."""

    effect: str
    clauses: tuple[Clause, ...]

    @property
    def failure(self) -> Clause | None:
        """The first clause that is broken."""
        return next((clause for clause in self.clauses if not clause.passed), None)

    @property
    def passed(self) -> bool:
        """Whether every clause is kept."""
        return self.failure is None

    def as_json(self) -> dict[str, Any]:
        """The report as JSON holds it."""
        clauses = [{"clause": each.clause, "passed": each.passed, "sentence": each.sentence} for each in self.clauses]
        return {"effect": self.effect, "passed": self.passed, "clauses": clauses}


def check(effect: Effect, *, limit_s: float = LIMIT_S) -> Report:
    """Try an effect's contract.

    A file's or a package's effect is tried in a process of its own, which is stopped after ``limit_s`` seconds;
    built-in effects and expressions end by themselves, and one that a program declares is tried where it is.

    Raises
    ------
    LutgenError
        The effect cannot be loaded again from its origin.

    """
    from lutgen.effects.own import installed

    if effect.origin.endswith(".py"):
        reports = {report.effect: report for report in check_file(effect.origin, limit_s=limit_s)}
        if effect.name not in reports:
            message = f"{effect.origin}: {pick_one('effect', effect.name, reports)}"
            raise LutgenError(message)
        return reports[effect.name]
    if effect in installed():
        return _reports(ask("check", "installed", effect.name, limit_s), effect.origin)[0]
    return Report(effect.name, tuple(examine(effect)))


def check_file(path: str | Path, *, limit_s: float = LIMIT_S) -> tuple[Report, ...]:
    """Try the contract of every effect in a file; errors as in :func:`lutgen.effects.own.load_file`."""
    return _reports(ask("check", "file", str(path), limit_s), str(path))


def refuse_unsound(
    files: Iterable[str | Path] = (), expressions: Iterable[str] = (), *, limit_s: float = LIMIT_S
) -> None:
    """Try the contract of all of a user's own effects, installed ones too, before anything relies on them.

    Raises
    ------
    LutgenError
        An effect cannot be loaded, or breaks a clause: the first one is told.

    """
    from lutgen.effects.expression import parse
    from lutgen.effects.own import installed

    reports = [(str(path), report) for path in files for report in check_file(path, limit_s=limit_s)]
    reports += [(effect.origin, check(effect, limit_s=limit_s)) for effect in (*installed(), *map(parse, expressions))]
    for origin, report in reports:
        refuse_broken(report, origin)


def refuse_broken(report: Report, origin: str) -> None:
    """Raise LutgenError with the first clause that an effect of that origin breaks, if it does."""
    if report.failure:
        message = (
            f"{origin}: effect {report.effect!r} breaks the contract, clause {report.failure.clause!r}: "
            f"{report.failure.sentence}"
        )
        raise LutgenError(message)


def _reports(answers: Answers, origin: str) -> tuple[Report, ...]:
    """Read a child's answers; the clause at which it stopped is broken, and effects after it are not tried."""
    reports: list[Report] = []
    stopped_at = ""
    for name in answers.effects(origin):
        said = [line for line in answers.lines if line.get("effect") == name]
        clauses = [Clause(line["clause"], line["passed"], line["sentence"]) for line in said if "clause" in line]
        if not said or "clause" in said[-1]:
            why = (
                f"It was not tried, after {stopped_at!r}." if stopped_at else f"It {answers.ended} when this is tried."
            )
            clauses.append(Clause(list(CLAUSES)[len(clauses)], passed=False, sentence=why))
            stopped_at = stopped_at or name
        reports.append(Report(name, tuple(clauses)))
    return tuple(reports)
