"""The result of a lint: findings, and what each reader does with the file.

A finding names the affected readers and what each reader does. The level is computed from these outcomes, so that no
rule can call a file harmless when a reader refuses it:

``error``    at least one reader accepts the file but shows other colours, or every reader refuses the file
``warning``  at least one reader refuses the file with a message
``note``     every reader shows what the author meant; the finding is only information
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

READS, REFUSES, WRONG = "reads", "refuses", "silently wrong"

#: Outcomes: of several outcomes of a reader the last in this order counts. A refused file cannot be shown wrong.
OUTCOMES = (READS, WRONG, REFUSES)

LEVELS = ("error", "warning", "note")

OCIO_21, OCIO_26 = "OpenColorIO 2.1", "OpenColorIO 2.6"
FFMPEG, PILLOW, COLOUR = "ffmpeg lut3d", "pillow_lut", "colour"
CLF_IO = "colour-clf-io"
BLENDER, NUKE, DJV = "Blender", "Nuke", "DJV"
LCMS_8, LCMS_16 = "LittleCMS, 8 bit", "LittleCMS, 16 bit"
ARGYLL, CHROMIUM = "Argyll", "Chromium"
HALDCLUT, OBS = "ffmpeg haldclut", "OBS Studio"

#: A program that checks configs. It shows no pictures.
OCIOCHECK = "ociocheck"

#: The readers of each kind of file. oiiotool, ociobakelut, Blender and Nuke read LUT files through OpenColorIO.
OCIO = (OCIO_21, OCIO_26)
READERS: Mapping[str, tuple[str, ...]] = {
    "cube": (*OCIO, FFMPEG, PILLOW, COLOUR),
    "clf": (*OCIO, CLF_IO),
    "lut": OCIO,
    "3dl": (*OCIO, FFMPEG),
    "config": (*OCIO, BLENDER, NUKE, DJV),
    "archive": (OCIO_26,),
    "profile": (LCMS_8, LCMS_16, ARGYLL, CHROMIUM),
    "link": (LCMS_8, LCMS_16, ARGYLL),
    "hald": (HALDCLUT,),
    "obs": (OBS, HALDCLUT),
}


class Fate(NamedTuple):
    """What one reader does with a file: one of ``OUTCOMES``, and details in a few words."""

    outcome: str
    how: str = ""


def refused(*readers: str, how: str = "") -> dict[str, Fate]:
    """Return the fate of readers that stop with an error."""
    return {reader: Fate(REFUSES, how) for reader in readers}


def wrong(*readers: str, how: str) -> dict[str, Fate]:
    """Return the fate of readers that give no error and show other colours."""
    return {reader: Fate(WRONG, how) for reader in readers}


@dataclass(frozen=True)
class LintFinding:
    """One fact about a file that affects a reader, or that the file's author should know."""

    #: The fact, as a sentence without its subject, which is the file; and what to do about the fact.
    what: str
    remedy: str
    #: Line number of the first occurrence, from 1; 0 for no line.
    line: int = 0
    #: What the affected readers do. Readers without an entry show what the author meant.
    fates: Mapping[str, Fate] = field(default_factory=dict)
    #: Whether the fault is in the numbers themselves, which readers show as stored, so that no trial can find it.
    in_the_file: bool = False
    #: Name of the rule, set by ``formats.findings``.
    rule: str = ""

    def level(self, readers: tuple[str, ...]) -> str:
        """Return ``error``, ``warning`` or ``note`` for ``readers``, the readers of this kind of file."""
        outcomes = {self.fates.get(reader, Fate(READS)).outcome for reader in readers}
        if WRONG in outcomes or outcomes == {REFUSES}:
            return "error"
        return "warning" if REFUSES in outcomes else "note"


class Trial(NamedTuple):
    """The result of an installed reader: one of ``OUTCOMES`` ("": not tried), and its message."""

    reader: str
    version: str
    outcome: str
    message: str


@dataclass(frozen=True)
class Linted:
    """The result of a lint of one file."""

    path: Path
    #: A key of ``READERS``.
    kind: str
    #: Size, version and contents of the file, as text.
    facts: tuple[str, ...]
    #: The findings, in the order of the rules' names.
    findings: tuple[LintFinding, ...]
    #: The results of installed readers, if they were tried.
    trials: tuple[Trial, ...] = ()

    @property
    def readers(self) -> tuple[str, ...]:
        """The readers of this kind of file."""
        return READERS[self.kind]

    @property
    def clean(self) -> bool:
        """Whether every reader shows what the author meant, by the rules and by the trials."""
        good = all(trial.outcome in {READS, ""} for trial in self.trials)
        return good and all(finding.level(self.readers) == "note" for finding in self.findings)

    def fate(self, reader: str) -> tuple[Fate, LintFinding | None]:
        """Return a reader's fate with the file, and the finding that predicts it; None for a correct reading."""
        return _worst(reader, self.findings)

    def disagreements(self) -> tuple[Trial, ...]:
        """Return the trials in which a reader did not do what the rules predict."""
        return tuple(trial for trial in self.trials if trial.outcome and not self._is_predicted(trial))

    def _is_predicted(self, trial: Trial) -> bool:
        if trial.reader == OCIOCHECK:
            # ociocheck refuses fewer files than its OpenColorIO library, since it opens no LUT and shows no picture.
            library = OCIO_21 if trial.version.startswith("2.1.") else OCIO_26
            return trial.outcome == READS or self.fate(library)[0].outcome == REFUSES
        of_readers = [finding for finding in self.findings if not finding.in_the_file]
        return trial.outcome in {_worst(trial.reader, each)[0].outcome for each in (self.findings, of_readers)}

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON data; see ``schema/lint.json``."""
        fates = {reader: self.fate(reader) for reader in self.readers}
        return {
            "file": str(self.path),
            "kind": self.kind,
            "clean": self.clean,
            "facts": list(self.facts),
            "readers": {
                reader: {**fate._asdict(), "rule": finding.rule if finding else None}
                for reader, (fate, finding) in fates.items()
            },
            "findings": [
                {
                    "rule": each.rule,
                    "level": each.level(self.readers),
                    "line": each.line or None,
                    "what": each.what,
                    "remedy": each.remedy,
                    "readers": {reader: fate._asdict() for reader, fate in each.fates.items()},
                }
                for each in self.findings
            ],
            "trials": [trial._asdict() for trial in self.trials],
        }


def _worst(reader: str, findings: Sequence[LintFinding]) -> tuple[Fate, LintFinding | None]:
    fates = [(finding.fates[reader], finding) for finding in findings if reader in finding.fates]
    return max(fates, key=lambda pair: OUTCOMES.index(pair[0].outcome)) if fates else (Fate(READS), None)
