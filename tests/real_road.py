"""The complete workflow on pairs of sessions of one display: compare, diagnose, refine, build, check.

``python -m tests.real_road [--cut N] [--baseline NAME]... [--keep DIR] FILE...`` pairs the files of each display by
their names and assumes 0 and 1000 h for each pair, because the true hours are unknown. It runs the commands as a user
would and prints a row for each pair and baseline: verdict, mean ΔE2000 before and after, exit codes, processor time.
The exit code is 1 if a command ends in a traceback, or if a written file does not build and check.
"""

from __future__ import annotations

import argparse
import itertools
import json
import re
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tests.command import here

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

#: Assumed hours, not counted hours.
LATER_H = 1000

BASELINES = ("first-hour", "native", "native-first-hour")

#: A file's name: display, date.
NAMED = re.compile(r"(.+?)_(?:(\d{4})-(\d\d)-(\d\d)_|(\d\d)-(\d\d)-(\d{4})_|(\d{4})(\d\d)(\d\d)_)(.*)")


class Ran(NamedTuple):
    """The result of a command; ``code`` is −1 after a traceback."""

    code: int
    out: str
    err: str
    seconds: float


def pairs(files: Sequence[Path]) -> Iterator[tuple[Path, Path]]:
    """Yield each pair of sessions of one display, the earlier session first."""

    def key(file: Path) -> tuple[str, ...]:
        parts = NAMED.fullmatch(file.name)
        if parts is None:
            raise SystemExit(f"{file}: the name does not begin with display and date")
        name, y, m, d, d2, m2, y2, y3, m3, d3, rest = parts.groups()
        return (name, *((y, m, d) if y else (y2, m2, d2) if y2 else (y3, m3, d3)), rest)

    for _, group in itertools.groupby(sorted(files, key=key), key=lambda file: key(file)[0]):
        yield from itertools.combinations(group, 2)


def run(*arguments: object) -> Ran:
    """Run ``lutgen`` in this process; a traceback becomes its standard error."""
    start = time.process_time()
    try:
        done = here(*arguments)
        code, out, err = done.returncode, done.stdout, done.stderr
    except Exception:  # noqa: BLE001 - whatever a command lets through is what is looked for
        code, out, err = -1, "", traceback.format_exc()
    return Ran(-1 if "Traceback" in err else code, out, err, time.process_time() - start)


def cut(file: Path, count: int, folder: Path) -> Path:
    """Copy a .ti3 or CSV and keep ``count`` readings.

    They are black, the colour points, and other readings drawn at random; the file's name is the seed.
    """
    lines = file.read_text(encoding="utf-8").splitlines()
    ti3 = file.suffix == ".ti3"
    begin, end = (lines.index("BEGIN_DATA") + 1, lines.index("END_DATA")) if ti3 else (1, len(lines))
    names = lines[lines.index("BEGIN_DATA_FORMAT") + 1].split() if ti3 else lines[0].lower().split(",")
    columns = [names.index(name) for name in (("RGB_R", "RGB_G", "RGB_B") if ti3 else ("r", "g", "b"))]
    cells = [line.split() if ti3 else line.split(",") for line in lines[begin:end]]
    drive = np.array([[float(row[column]) for column in columns] for row in cells])
    drive /= drive.max()
    ends = [(drive == code).all(axis=1).argmax() for code in ([0, 0, 0], [1, 1, 1], *np.eye(3))]
    others = np.setdiff1d(np.arange(len(drive)), ends)
    others = np.random.default_rng(list(file.name.encode())).permutation(others)[: count - len(ends)]
    kept = [lines[begin + row] for row in sorted([*ends, *others])]
    head = [re.sub(r"^NUMBER_OF_SETS .*", f"NUMBER_OF_SETS {count}", line) for line in lines[:begin]]
    copy = folder / file.name
    copy.write_text("\n".join([*head, *kept, *lines[end:]]) + "\n", encoding="utf-8")
    return copy


def campaign_of(pair: tuple[Path, Path], folder: Path) -> Path:
    """Write a campaign of two sessions."""
    blocks = ["schema = 1"]
    for file, hours in zip(pair, (0, LATER_H), strict=True):
        blocks.append(f'[[sessions]]\nfile = "{file}"\nhours = {hours}')
    file = folder / "pair.toml"
    file.write_text("\n".join(blocks), encoding="utf-8")
    return file


def road(data: Path, baseline: str, folder: Path) -> dict[str, Ran]:
    """Run all commands that can run."""
    asked, model = (data, "--baseline", baseline), folder / "model.toml"
    done = {"compare": run("compare", *asked), "diagnose": run("diagnose", *asked, "--json", folder / "diagnose.json")}
    done["refine"] = run("refine", *asked, "--auto", "-o", model, "--json", folder / "refine.json")
    if model.exists():
        done["build"] = run(
            "build", "--model", model, "--hours", f"0,{LATER_H}", "--mode", "chroma-luma", "-o", folder / "built"
        )
    if (folder / "built").is_dir():
        done["check"] = run("check", folder / "built")
    return done


def row(done: dict[str, Ran], folder: Path) -> str:
    """Return one row of the table without its first cells."""
    verdict, names, before, after = "–", "", float("nan"), float("nan")
    if (folder / "diagnose.json").exists():
        content = json.loads((folder / "diagnose.json").read_text())
        verdict, names = content["verdict"], ", ".join(content["effects"])
    if (folder / "refine.json").exists():
        content = json.loads((folder / "refine.json").read_text())
        before, after = content["before"]["delta_e_mean"], content["after"]["delta_e_mean"]
    written = "yes" if (folder / "model.toml").exists() else "no"
    codes = " ".join(f"{name} {each.code}" for name, each in done.items() if each.code)
    seconds = " + ".join(f"{each.seconds:.0f}" for each in done.values())
    return f"{verdict} {names} | {before:.2f} → {after:.2f} | {written} | {codes} | {seconds}"


def main(arguments: Sequence[str]) -> int:
    """Print the table. Return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--cut", type=int, help="readings of each session that are kept")
    parser.add_argument("--baseline", action="append", choices=BASELINES)
    parser.add_argument("--keep", type=Path, help="folder for what the commands printed")
    asked = parser.parse_args(arguments)
    wrong = 0
    print("| earlier | later | baseline | verdict | mean ΔE2000 | written | exit codes but 0 | processor s |")
    print("|---|---|---|---|---|---|---|---|")
    for place, pair in enumerate(pairs(asked.files)):
        for baseline in asked.baseline or BASELINES:
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                sessions = tuple(cut(file, asked.cut, folder) if asked.cut else file.resolve() for file in pair)
                done = road(campaign_of((sessions[0], sessions[1]), folder), baseline, folder)
                print(f"| {pair[0].stem[:45]} | {pair[1].stem[:45]} | {baseline} | {row(done, folder)} |", flush=True)
                wrong += any(each.code < 0 for each in done.values())
                wrong += any(done[step].code != 0 for step in ("build", "check") if step in done)
                if asked.keep:
                    asked.keep.mkdir(parents=True, exist_ok=True)
                    text = "\n".join(f"== {step} {each.code}\n{each.out}\n{each.err}" for step, each in done.items())
                    (asked.keep / f"{place:02d}-{baseline}.txt").write_text(text, encoding="utf-8")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
