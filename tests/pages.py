"""Run every command in README.md and the pages of docs/, in order, each page in its own folder.

    python -m tests.pages [PAGE]…            print where a page differs from its commands' output; exit 1 if one differs
    python -m tests.pages [PAGE]… --write    write the output into the pages, and the pictures into docs/images

A ``console`` block contains commands after ``$ ``, each followed by its output. ``…`` stands for whole lines that are
left out; a renewed page leaves out the same lines. A command without output in the page has to succeed; its output is
not compared. A block with ``title="NAME"`` is written to the file NAME before the commands after it run. A ``python``
block without a title is run. An ``sh`` block is run by bash, unless ``NOT_RUN`` or ``LONG`` names its first words, or
one of its programs is not installed. The picture docs/images/NAME-PLOT.png is PLOT.png of a command with ``--plots
out/NAME``, in fewer colours; other pictures keep their names.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory

from docs.generate.markup import MADE
from tests.examples_folder import ROOT, make_folder, run_lutgen

DOCS, PICTURES = ROOT / "docs", ROOT / "docs" / "images"

#: Pages whose commands are run: all pages except those generated from the code.
PAGES = (
    ROOT / "README.md",
    *sorted(path for path in DOCS.rglob("*.md") if MADE not in path.read_text(encoding="utf-8")),
)

#: First words of an ``sh`` block that no test runs → the reason. The page says so too, except beside set-up commands.
NOT_RUN = {
    "make demo": "set-up of a clone: .ci/run runs the targets of make",
    "make setup": "set-up of a clone: .ci/run runs the targets of make",
    "vips icc_transform": "it needs a picture with an embedded aged.icc and a PDF; make consumers runs both programs",
}

#: First words of an ``sh`` block that takes minutes and reads real sessions → the time. A test runs such a block before
#: a release.
LONG = {"python -m tests.own_model_table": "two minutes"}

#: Placeholder for lines that are left out.
LEFT_OUT = "…"

#: Number of colours of a picture in the text, which keeps the picture small, and rounds of k-means that choose the
#: colours. The error is at most 17 of 255 codes.
COLOURS, ROUNDS = 128, 3

#: Tolerance on numbers, in units of the last printed digit and as a share: platforms round differently.
UNITS, SHARE = 1.01, 1e-4

#: Lines with at least this similarity are the same line with new numbers.
ALIKE = 0.6

_BLOCK = re.compile(r'^```(\w+)(?: title="([^"\n]+)")?\n(.*?)^```$', flags=re.DOTALL | re.MULTILINE)
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Step:
    """A command and its output lines in the page."""

    command: str
    shown: tuple[str, ...]


@dataclass(frozen=True)
class File:
    """A file in a page; a file without a name is a script to run."""

    name: str
    text: str


@dataclass(frozen=True)
class Shell:
    """Lines of a shell, which other programs than lutgen read."""

    text: str

    def begins(self, words: Iterable[str]) -> bool:
        """Return whether the first line begins with any of these words."""
        return self.text.startswith(tuple(words))

    @property
    def missing(self) -> list[str]:
        """The programs of the lines that are not installed."""
        programs = [re.match(r"(?!export |\w+=)\S+", line) for line in self.text.splitlines()]
        return [found[0] for found in programs if found and not shutil.which(found[0])]

    @property
    def is_run(self) -> bool:
        """Whether the runner of the pages runs these lines here."""
        return not self.begins((*NOT_RUN, *LONG)) and not self.missing

    def run(self, folder: Path) -> None:
        """Run the lines in a folder; fail if one fails."""
        _run(["bash", "-euc", self.text], folder, what=self.text)


def items(text: str) -> list[Step | File | Shell]:
    """Return all commands and files in a page, in order."""
    parts: list[Step | File | Shell] = []
    for language, title, body in _BLOCK.findall(text):
        if language == "console":
            parts += [_step(part) for part in _parts(body)]
        elif language == "sh":
            parts.append(Shell(body))
        elif title or language == "python":
            parts.append(File(title, body))
    return parts


def steps(text: str) -> list[Step]:
    """Return all commands of a page, in order."""
    return [each for each in items(text) if isinstance(each, Step)]


def shells(text: str) -> list[Shell]:
    """Return all ``sh`` blocks of a page, in order."""
    return [each for each in items(text) if isinstance(each, Shell)]


def plain(command: str) -> str:
    """Return a command without its comment, in normalised spelling."""
    return shlex.join(shlex.split(command, comments=True))


def all_commands() -> list[str]:
    """Return the commands of all pages, as :func:`plain` spells them."""
    return [plain(step.command) for page in PAGES for step in steps(page.read_text(encoding="utf-8"))]


def _parts(body: str) -> list[str]:
    return [part for part in re.split(r"^(?=\$ )", body, flags=re.MULTILINE) if part.startswith("$ ")]


def _step(part: str) -> Step:
    command, _, shown = part.removeprefix("$ ").partition("\n")
    return Step(command, tuple(shown.rstrip("\n").splitlines()))


def prepare(folder: Path) -> None:
    """Put the files that commands of the pages name into an empty folder: examples, simulator, default configs."""
    make_folder(folder)
    away = shutil.ignore_patterns("__pycache__", "*.jpg")
    shutil.copytree(ROOT / "examples", folder / "examples", ignore=away, dirs_exist_ok=True)
    shutil.copytree(ROOT / "tests/virtual_display", folder / "tests/virtual_display", ignore=away)
    (folder / "configs").symlink_to(ROOT / "configs")


def run_page(text: str, folder: Path) -> list[tuple[str, ...]]:
    """Run a page in a prepared folder; return the output lines of each command."""
    printed = []
    for each in items(text):
        if isinstance(each, Step):
            printed.append(run(each.command, folder))
        elif isinstance(each, Shell):
            if each.is_run:
                each.run(folder)
        elif each.name:
            (folder / each.name).write_text(each.text, encoding="utf-8")
        else:
            _python(["-c", each.text], folder, what=each.text)
    return printed


def run(command: str, folder: Path) -> tuple[str, ...]:
    """Run a command of a page in a folder; return its output lines; fail if the command fails."""
    program, *arguments = shlex.split(command, comments=True)
    out = _python(arguments, folder, what=command) if program == "python" else run_lutgen(command, folder)
    return tuple(line.rstrip() for line in out.rstrip().splitlines())


def _python(arguments: list[str], folder: Path, *, what: str) -> str:
    return _run([sys.executable, *arguments], folder, what=what)


def _run(command: list[str], folder: Path, *, what: str) -> str:
    programs = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    environment = os.environ | {
        "PYTHONUTF8": "1", "PYTHONPATH": os.pathsep.join(["", str(ROOT)]), "PATH": programs
    }  # fmt: skip
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, f"{what}\nfails in {folder}:\n{done.stderr}"
    return done.stdout


def differences(shown: tuple[str, ...], printed: tuple[str, ...]) -> list[str]:
    """Return where a page differs from the output, except in last digits and in lines that ``…`` leaves out."""
    place, free = 0, not shown
    for line in shown:
        if line == LEFT_OUT:
            free = True
            continue
        line_number = next((at for at in range(place, len(printed)) if same(line, printed[at])), None)
        if line_number is None or (line_number > place and not free):
            near = printed[place] if place < len(printed) else "nothing more"
            return [f"the page says     {line}", f"it prints, there  {near}"]
        place, free = line_number + 1, False
    if place < len(printed) and not free:
        return ["the page says     nothing more", f"it prints, there  {printed[place]}"]
    return []


def same(one: str, other: str) -> bool:
    """Return whether two lines are equal: same words, numbers equal to about their last digit, spaces ignored."""
    if _words(one) != _words(other):
        return False
    return all(_near(*pair) for pair in zip(_NUMBER.findall(one), _NUMBER.findall(other), strict=True))


def _words(line: str) -> str:
    return " ".join(_NUMBER.sub("#", line).split())


def _near(one: str, other: str) -> bool:
    unit = 10.0 ** -len(one.partition(".")[2])
    return abs(float(one) - float(other)) <= max(UNITS * unit, SHARE * abs(float(one)))


def renewed(text: str, printed: list[tuple[str, ...]]) -> str:
    """Write the commands' output into a page; leave out the lines that the page leaves out."""
    outputs = iter(printed)

    def renew(block: re.Match[str]) -> str:
        if block[1] != "console":
            return block[0]
        parts = [(_step(part), next(outputs)) for part in _parts(block[3])]
        lines = [line for step, new in parts for line in (f"$ {step.command}", *_kept(step.shown, new))]
        return "\n".join(["```console", *lines, "```"])

    return _BLOCK.sub(renew, text)


def _kept(shown: tuple[str, ...], printed: tuple[str, ...]) -> list[str]:
    """Return the output lines that the page has too."""
    if not shown:
        return []
    kept: list[int] = []
    for line in shown:
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
    """Return the pictures of docs/images that the page's commands make → the path where a command writes each."""
    folders = re.findall(r"--plots out/(\S+)", text)
    targets = re.findall(r"images/([\w-]+\.(?:png|jpg))", text)
    files = {}
    for target in map(Path, targets):
        name = next((each for each in folders if target.name.startswith(f"{each}-")), "")
        source = Path("out", name, target.name.removeprefix(f"{name}-") if name else target.name)
        if name or f"$ python -m examples.{target.stem.replace('-', '_')}" in text:
            files[PICTURES / target] = source
    return files


def main() -> int:
    """Run and compare, or renew. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.pages", description="Run README.md and docs/.")
    parser.add_argument("pages", nargs="*", type=Path, help="some pages instead of all")
    parser.add_argument("--write", action="store_true", help="renew the pages and their pictures")
    options, off = parser.parse_args(), 0
    for page in options.pages or PAGES:
        text = page.read_text(encoding="utf-8")
        with TemporaryDirectory() as scratch:
            folder = Path(scratch)
            prepare(folder)
            printed = run_page(text, folder)
            for step, lines in zip(steps(text), printed, strict=True):
                faults = differences(step.shown, lines)
                off += bool(faults)
                print("\n".join([f"$ {step.command}", *faults]), flush=True)
            if options.write:
                page.write_text(renewed(text, printed), encoding="utf-8")
                for target, source in pictures(text).items():
                    _save_small(folder / source, target)
    return 1 if off and not options.write else 0


def _save_small(source: Path, target: Path) -> None:
    """Copy a picture; reduce the colours of a PNG."""
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
