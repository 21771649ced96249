from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lutgen.cells import number
from lutgen.cli.command import Command
from lutgen.cli.options import WholeFrom
from lutgen.cli.outputs import progress_bar, say
from lutgen.errors import LutgenError
from lutgen.files import check_new_file, write_atomically

if TYPE_CHECKING:
    from lutgen.progress import Progress
    from lutgen.study.protocol import Protocol


@click.command(cls=Command)
@click.argument("study", metavar="STUDY")
@click.option("--seed", type=WholeFrom(min=0), required=True, help="Seed of the simulated readers.")
@click.option(
    "--difference",
    "given",
    multiple=True,
    metavar="CONDITION=ΔE",
    help="ΔE2000 at nuclei under a condition, such as chroma@18000=5.1 [default: measured in the study's images].",
)
@click.option("-o", "--output", required=True, metavar="FILE", help="The table of answers (.csv).")
@click.option("--force", is_flag=True, help="Replace a file that exists.")
def command(*, study: str, seed: int, given: tuple[str, ...], output: str, force: bool) -> None:
    """Answer a planned study with simulated readers, to rehearse its analysis before anybody reads.

    Simulated readers slow down, find reading harder and change their diagnosis with the colour difference at nuclei:
    ΔE2000 measured at the nuclei of every image (with lutgen[nuclei]), or given for every aged condition. Their default
    effects have the size of the paper's Tables 2 and 3, at 18 000 h; these hours are lutgen's assumption, the paper
    states none. The first line of the table says that it is simulated; the study's own answers stay unchanged.
    --difference chroma@18000=0 shows what the analysis finds without a true difference.

    \b
    Example:
      lutgen study simulate study/ --seed 1 --difference chroma@18000=5.1 -o simulated.csv
      lutgen study analyse --answers simulated.csv
    """
    from lutgen.study.protocol import read_protocol
    from lutgen.study.simulated import SimulatedReader, simulate
    from lutgen.study.tables import answer_table

    path = check_new_file(output, force=force, suffixes=(".csv",))
    folder = Path(study)
    protocol = read_protocol(folder)
    with progress_bar("measuring nuclei") as progress:
        differences = _differences(folder, protocol, given, progress)
    reader = SimulatedReader(seed=seed, categories=protocol.categories, ease=protocol.ease)
    answers = simulate(protocol.trials, differences, reader)
    how = f"ΔE at nuclei given: {', '.join(given)}" if given else "ΔE at nuclei measured"
    remark = f"SIMULATED answers, nobody read anything: lutgen study simulate, seed {seed}; {how}"
    write_atomically(path, answer_table(answers, remark=remark).encode())
    say(f"{path}: {len(answers)} SIMULATED answers. Analyse them: lutgen study analyse --answers {path}")


def _differences(
    folder: Path, protocol: Protocol, given: tuple[str, ...], progress: Progress
) -> dict[tuple[str, str], float]:
    if not given:
        from lutgen.study.simulated import measured_differences

        return measured_differences(folder, protocol, progress)
    from lutgen.study.statistics import UNAGED

    aged = [condition.name for condition in protocol.conditions if condition.name != UNAGED]
    if not aged:
        raise LutgenError(f"--difference: the study in {folder} has no aged condition. Leave --difference out.")
    by_condition = dict(_given(text, aged) for text in given)
    missing = [condition for condition in aged if condition not in by_condition]
    if missing:
        raise LutgenError(f"--difference lacks {', '.join(missing)}. Give every aged condition, or none.")
    return {(image.name, name): value for image in protocol.images for name, value in by_condition.items()}


def _given(text: str, aged: list[str]) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    difference = number(value)
    if name not in aged or difference is None or difference < 0:
        raise LutgenError(
            f"--difference {text}: give one of {', '.join(aged)}, =, and ΔE2000 from 0, such as {aged[0]}=5.1."
        )
    return name, difference
