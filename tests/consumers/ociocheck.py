"""``ociocheck``, which checks configs."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from lutgen.lint import lint
from lutgen.lint.finding import OCIOCHECK, READS, REFUSES, Linted
from tests.consumers import Claim, Unavailable
from tests.consumers._claims import unlike

OURS = Path(__file__).parents[2] / "configs/default/chroma/10000h"

#: Changed variants of our config, and the result of each.
CONFIGS = {
    "as it is": ("", "", READS),
    "of a version to come": ("ocio_profile_version: 2.1", "ocio_profile_version: 2.9", REFUSES),
    "broken": ("roles:", "roles: {", REFUSES),
}


def version() -> str:
    if shutil.which(OCIOCHECK) is None:
        raise Unavailable("ociocheck is not on PATH; Debian has it in the package opencolorio-tools")
    return lint(OURS / "config.ocio", ask_readers=True).trials[0].version


def configs(folder: Path) -> Iterator[str]:
    shutil.copyfile(OURS / "aged.clf", folder / "aged.clf")
    text = (OURS / "config.ocio").read_text(encoding="utf-8")
    path = folder / "config.ocio"
    for name, (old, new, statement) in CONFIGS.items():
        path.write_text(text.replace(old, new), encoding="utf-8")
        report: Linted = lint(path, ask_readers=True)
        for trial in report.trials:
            yield from unlike(name, trial.outcome, statement)
        if report.disagreements():
            yield f"{name}: the rules say otherwise of its OpenColorIO"


CLAIMS = [Claim("ociocheck", version, f"refuses {len(CONFIGS)} configs where lint says that OpenColorIO does", configs)]
