"""Try the contract of an effect, built-in or a user's own, in this process.

The clauses of the contract are in :mod:`lutgen.effects.clauses`. :mod:`lutgen.effects.child` tries a file under limits
of time and memory, for ``lutgen effects --check``.
"""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lutgen.effects.clauses import Clause, examine
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from lutgen.effects.declare import Effect


@dataclass(frozen=True)
class Report:
    """The result of trying the contract of an effect, clause by clause."""

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


def check(effect: Effect) -> Report:
    """Try an effect's contract in this process; what the effect prints goes to standard error."""
    with redirect_stdout(sys.stderr):
        return Report(effect.name, tuple(examine(effect)))


def refuse_unsound(files: Iterable[str | Path] = (), expressions: Iterable[str] = ()) -> None:
    """Try the contract of all of a user's own effects, installed ones too, before anything relies on them.

    Raises
    ------
    LutgenError
        An effect cannot be loaded, or breaks a clause: the message tells the first one.

    """
    from lutgen.effects.expression import parse
    from lutgen.effects.own import installed, load_file

    for each in (*(each for path in files for each in load_file(path)), *installed(), *map(parse, expressions)):
        refuse_broken(check(each), each.origin)


def refuse_broken(report: Report, origin: str) -> None:
    """Raise LutgenError with the first clause that an effect of that origin breaks, if it does."""
    if report.failure:
        message = (
            f"{origin}: effect {report.effect!r} breaks the contract, clause {report.failure.clause!r}: "
            f"{report.failure.sentence}"
        )
        raise LutgenError(message)
