"""Runs WALKTHROUGH.md: every command in it, in order, in a copy of this folder.

    python -m examples.walkthrough            say where the text differs from what the commands print; exit 1 if it does
    python -m examples.walkthrough --write    put what they print into the text, and their pictures beside it

A block of the text that begins with ``$ `` holds a command and what it prints. Lines may be left out, as whole lines,
where ``…`` stands; a renewed text leaves out the same ones. The picture walkthrough/NAME-PLOT.png is PLOT.png of a
command with ``--plots out/NAME``, in fewer colours; other pictures keep their names.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory

FOLDER = Path(__file__).resolve().parent
TEXT, PICTURES = FOLDER / "WALKTHROUGH.md", FOLDER / "walkthrough"

#: What stands for lines that are left out.
LEFT_OUT = "…"

#: Colours of a picture in the text, so that it stays small, and rounds of k-means in which they are chosen: at most 17
#: of 255 codes off.
COLOURS, ROUNDS = 128, 3

#: Numbers may differ by so many units of their last printed digit, or by this share: platforms round differently.
UNITS, SHARE = 1.01, 1e-4

#: Lines more alike than this are the same line, told anew.
ALIKE = 0.6

BLOCK = re.compile(r"^```\n\$ (.*?)^```$", flags=re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Step:
    """A command of the text and the lines that the text says it prints."""

    command: str
    said: tuple[str, ...]


def steps(text: str) -> list[Step]:
    """All commands, in order."""
    found = []
    for block in BLOCK.findall(text):
        command, _, said = block.partition("\n")
        found.append(Step(command, tuple(said.splitlines())))
    return found


def run(command: str, folder: Path) -> tuple[str, ...]:
    """Run a command of the text in a folder, and return the lines that it prints; raises SystemExit where it fails."""
    program, *arguments = shlex.split(command)
    known = {"lutgen": [sys.executable, "-m", "lutgen"], "python": [sys.executable]}
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    environment |= {"PYTHONUTF8": "1", "PYTHONPATH": os.pathsep.join(["", str(FOLDER.parent)])}
    done = subprocess.run(
        [*known[program], *arguments], cwd=folder, env=environment, capture_output=True, encoding="utf-8", check=False
    )
    if done.returncode:
        raise SystemExit(f"$ {command}\nfails in {folder}, with exit code {done.returncode}:\n{done.stderr}")
    lines = [line.rstrip() for line in done.stdout.rstrip().splitlines()]
    return tuple(lines)


def copy_to(folder: Path) -> None:
    """Copy what the commands need: this folder, without pictures, and the simulator."""
    here = shutil.ignore_patterns("__pycache__", "*.jpg", PICTURES.name)
    shutil.copytree(FOLDER, folder / FOLDER.name, ignore=here)
    shutil.copytree(FOLDER.parent / "tests" / "virtual_display", folder / "tests" / "virtual_display", ignore=here)


def differences(said: tuple[str, ...], printed: tuple[str, ...]) -> list[str]:
    """Say where the text differs from what is printed, but for last digits and for what ``…`` leaves out."""
    place, free = 0, False
    for line in said:
        if line == LEFT_OUT:
            free = True
            continue
        found = next((at for at in range(place, len(printed)) if same(line, printed[at])), None)
        if found is None or (found > place and not free):
            near = printed[place] if place < len(printed) else "nothing more"
            return [f"the text says      {line}", f"it prints, there   {near}"]
        place, free = found + 1, False
    if place < len(printed) and not free:
        return ["the text says      nothing more", f"it prints, there   {printed[place]}"]
    return []


def same(one: str, other: str) -> bool:
    """Whether two lines say the same: words alike, numbers to about their last digit, whatever the spaces."""
    if _words(one) != _words(other):
        return False
    return all(_near(*pair) for pair in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True))


def _words(line: str) -> str:
    return " ".join(NUMBER.sub("#", line).split())


def _near(one: str, other: str) -> bool:
    unit = 10.0 ** -len(one.partition(".")[2])
    return abs(float(one) - float(other)) <= max(UNITS * unit, SHARE * abs(float(one)))


def renewed(text: str, printed: list[tuple[str, ...]]) -> str:
    """Put what the commands print into the text, leaving out what the text leaves out."""
    outputs = iter(printed)

    def renew(block: re.Match[str]) -> str:
        command, _, said = block[1].partition("\n")
        lines = _kept(said.splitlines(), next(outputs))
        return "\n".join([f"```\n$ {command}", *lines, "```"])

    return BLOCK.sub(renew, text)


def _kept(said: list[str], printed: tuple[str, ...]) -> list[str]:
    """Of what is printed, the lines that the text has too; all where it has none."""
    if not said:
        return list(printed)
    kept: list[int] = []
    for line in said:
        start = kept[-1] + 1 if kept else 0
        alike = [(_alike(line, printed[at]), -at) for at in range(start, len(printed))] if line != LEFT_OUT else []
        best, at = max(alike, default=(0.0, 0))
        if best > ALIKE:
            kept.append(-at)
    lines: list[str] = []
    for before, at in zip_longest([-1, *kept], [*kept, len(printed)]):
        between = printed[before + 1 : at]
        lines += [LEFT_OUT] if any(between) else between
        lines += printed[at : at + 1]
    return lines


def _alike(one: str, other: str) -> float:
    return SequenceMatcher(None, _words(one), _words(other), autojunk=False).ratio()


def pictures(text: str) -> dict[Path, Path]:
    """Pictures of the text → where the commands write them."""
    targets = [Path(target) for target in re.findall(rf"!\[[^\]]*\]\({PICTURES.name}/([^)]+)\)", text)]
    folders = re.findall(r"--plots out/(\S+)", text)
    found = {}
    for target in targets:
        name = next((each for each in folders if target.name.startswith(f"{each}-")), "")
        found[PICTURES / target] = Path("out", name, target.name.removeprefix(f"{name}-") if name else target.name)
    return found


def main() -> int:
    """Run and compare, or renew; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m examples.walkthrough", description="Run WALKTHROUGH.md.")
    parser.add_argument("--write", action="store_true", help="renew the text and its pictures")
    write, text, off = parser.parse_args().write, TEXT.read_text(encoding="utf-8"), 0
    with TemporaryDirectory() as scratch:
        folder, printed = Path(scratch), []
        copy_to(folder)
        for step in steps(text):
            printed.append(run(step.command, folder))
            found = differences(step.said, printed[-1])
            off += bool(found)
            print("\n".join([f"$ {step.command}", *found]), flush=True)
        if write:
            TEXT.write_text(renewed(text, printed), encoding="utf-8")
            for target, source in pictures(text).items():
                _save_small(folder / source, target)
    return 1 if off and not write else 0


def _save_small(source: Path, target: Path) -> None:
    """Copy a picture; a PNG in fewer colours."""
    from PIL import Image

    target.parent.mkdir(exist_ok=True)
    if source.suffix == ".png":
        with Image.open(source) as image:
            few = image.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, ROUNDS, dither=Image.Dither.NONE)
            few.save(target, optimize=True)
    else:
        shutil.copyfile(source, target)


if __name__ == "__main__":
    sys.exit(main())
