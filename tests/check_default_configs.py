"""Check that the code still produces ``configs/default``: build it in a temporary folder and compare.

LUTs are compared byte by byte. Configs are compared as this OpenColorIO writes them after reading, because versions
write them differently. The recipe is compared as JSON. No unlisted file may exist. ``make check-configs`` runs this
script; on exit code 1 the output names the differences.
"""

import json
import sys
import tempfile
from pathlib import Path

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.manifest import MANIFEST, read_manifest
from lutgen.bindings import ocio
from lutgen.display import DisplayModel, default_display
from lutgen.display.tips import parse_hours
from lutgen.names import MODES
from lutgen.readings import read_measurements

COMMITTED = Path(__file__).resolve().parents[1] / "configs" / "default"


def differences(committed: Path) -> list[str]:
    """Return the differences between ``committed`` and the output of the present code."""
    model = DisplayModel(read_measurements(default_display()), selection="continuous")
    plan = BuildPlan(tuple(parse_hours("0..18000", model.tips)), modes=tuple(MODES), formats=("clf",))
    committed_manifest = read_manifest(committed / MANIFEST)
    if committed_manifest is None:
        return [f"{MANIFEST} is missing"]
    with tempfile.TemporaryDirectory() as scratch:
        fresh = Path(scratch)
        manifest = build(model, plan, fresh).manifest
        recipe = {key: value for key, value in json.loads(manifest.as_bytes()).items() if key != "files"}
        faults = [f"{MANIFEST}: the recipe differs"] if recipe != committed_manifest.recipe else []
        wanted = {record.path for record in manifest.files} | {MANIFEST}
        present = {path.relative_to(committed).as_posix() for path in committed.rglob("*") if path.is_file()}
        faults += [f"{path}: missing" for path in sorted(wanted - present)]
        faults += [f"{path}: not made by the code" for path in sorted(present - wanted)]
        for path in sorted(wanted & present - {MANIFEST}):
            if _content(committed / path) != _content(fresh / path):
                faults.append(f"{path}: differs")
    return faults


def _content(path: Path) -> str:
    if path.suffix == ".ocio":
        return str(ocio().Config.CreateFromFile(str(path)).serialize())
    return path.read_text(encoding="utf-8")


def main() -> None:
    """Print the differences; exit with 1 if there are any."""
    faults = differences(COMMITTED)
    for difference in faults:
        print(difference)
    if faults:
        sys.exit("configs/default does not follow from the code: run `make configs` and look at what changes.")
    print("configs/default follows from the code")


if __name__ == "__main__":
    main()
