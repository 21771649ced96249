"""``lutgen lint --try`` on a config: the checkers that are installed."""

from __future__ import annotations

import shutil
import subprocess
from typing import TYPE_CHECKING

from lutgen.bake.lint.finding import OCIOCHECK, READS, REFUSES, Trial
from lutgen.bake.lint.programs import TIMEOUT

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


def try_config(path: Path) -> Iterator[Trial]:
    """Run ``ociocheck``, which loads and validates, and looks at no LUT file."""
    found = shutil.which(OCIOCHECK)
    if found is None:
        yield Trial(OCIOCHECK, "", "", "ociocheck is not on the PATH (Debian: apt install opencolorio-tools)")
        return
    try:
        done = subprocess.run(  # noqa: S603 - no shell
            [found, "--iconfig", str(path)], capture_output=True, check=False, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        yield Trial(OCIOCHECK, "", REFUSES, f"gives no answer in {TIMEOUT} s")
        return
    said = [line for line in done.stdout.decode(errors="replace").splitlines() if line.strip()]
    version = next((line.split(":")[1].strip() for line in said if line.startswith("OpenColorIO Library Version")), "")
    failed = bool(done.returncode)
    yield Trial(
        OCIOCHECK, version, REFUSES if failed else READS, said[-1] if failed and said else "loads and validates"
    )
