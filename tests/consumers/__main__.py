"""``make consumers``: the results of real programs with lutgen's files, and whether they agree with lutgen's claims.

The first table compares each program's rendering of a real image with the direct model, in 8-bit codes. The second
table lists the claims of lutgen's rules and texts about each program, with the program's version and every case where
the program behaves differently.
"""

import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

# colour-science warns at import about optional packages that nothing here needs.
warnings.filterwarnings("ignore", module="colour")

from tests.consumers import Claim, Consumer, Unavailable, claims, consumers  # noqa: E402 - after the filter
from tests.consumers._gallery import CASES, GATES, RESAMPLED, Case, Gallery, gates  # noqa: E402

COLUMNS = "{:<37} {:<18} {:<18} {:<12} {:<10} {:<12} {:>6} {:>7} {:>7} {:>7}  {}"
#: Exceptions of a program's failure; a failure is a result like any other.
FAILURES = (RuntimeError, subprocess.SubprocessError)

CLAIM = "{:<20} {:<22} {:<8} {}"
HEAD = ("consumer", "version", "file", "interpolates", "selection", "mode", "hours", "mean", "99 %", "max", "gate")


def main() -> int:
    """Print both tables. Return 1 if a gate is not met or a program contradicts a claim."""
    with tempfile.TemporaryDirectory(prefix="consumers-") as folder:
        gallery = Gallery(Path(folder))
        print(COLUMNS.format(*HEAD))
        held = [row(gallery, consumer, case) for consumer in consumers() for case in CASES]
    limits = ", ".join(f"{limit:g} where {interpolation}" for interpolation, limit in GATES.items())
    largest = max(gates(case)[RESAMPLED] for case in CASES)
    print(
        f"Errors in 8-bit codes, over all pixels and channels. Gate: 99 % of them at most {limits}; where the program "
        f"makes a table of its own of the profile ({RESAMPLED}) what a table of the model itself errs, 1 to "
        f"{largest:.4f}.\n"
    )
    print(CLAIM.format("program", "version", "", "what lutgen says that it does"))
    held += [holds(claim) for claim in claims()]
    return 0 if all(held) else 1


def row(gallery: Gallery, consumer: Consumer, case: Case) -> bool:
    """Print one row; an unavailable program fails no gate."""
    try:
        error = gallery.errors(gallery.render(consumer, case), case)
    except Unavailable as reason:
        if case == CASES[0]:
            print(f"{consumer.name:<37} not tested: {reason}")
        return True
    except FAILURES as failure:
        print(f"{consumer.name:<37} FAILS: {failure}")
        return False
    passes = error.passes(gates(case)[consumer.interpolation])
    numbers = (f"{value:.4f}" for value in (error.mean, error.p99, error.max))
    about = (consumer.name, consumer.version(), consumer.file, consumer.interpolation)
    print(COLUMNS.format(*about, case.selection, case.mode, f"{case.hours:g}", *numbers, "ok" if passes else "FAILS"))
    return passes


def holds(claim: Claim) -> bool:
    """Print one claim and the cases where the program contradicts it; an unavailable program contradicts nothing."""
    with tempfile.TemporaryDirectory(prefix="claim-") as folder:
        try:
            version = claim.version()
            differences = [*claim.differences(Path(folder))]
        except Unavailable as reason:
            print(f"{claim.program:<20} not tested: {reason}")
            return True
        except FAILURES as failure:
            differences = [f"it fails: {failure}"]
    print(CLAIM.format(claim.program, version, "DIFFERS" if differences else "ok", claim.says))
    for each in differences:
        print(f"    {each}")
    return not differences


if __name__ == "__main__":
    sys.exit(main())
