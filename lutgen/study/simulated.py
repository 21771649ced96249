"""A simulated reader: it answers a study before readers do, to rehearse and to test the analysis.

It is no model of a pathologist. It is the simplest reader that has the paper's effects (Avanaki et al. 2015, Tables 2
and 3) from one cause: aging changes the colours of nuclei, by ΔE2000 between their un-aged and aged pixels. The
reader's *disturbance* by a difference ΔE is

    D = 1 − exp(−ΔE / scale),

between 0 and 1, because the paper's effects hardly grow from chroma to chroma + luma aging while ΔE at nuclei triples.
With an image of difficulty δ, a standard normal number that is the same whenever the image is read, and noise ε:

    log(seconds) = log(median) + pace + spread_images δ + slowdown D + spread ε
    ease         = 10.59 − ease_images δ − ease_loss D + ease_spread ε,    rounded and cut to 1..10
    P(keeps its side of the diagnosis) = ½ (1 + exp(−doubt exp(doubt_images δ) − ΔE / scale)),

so that two readings of an image agree with probability ½ (1 + E[exp(−2 doubt exp(doubt_images δ))] exp(−ΔE / scale)):
one half, chance, when aging hides everything.

**Calibration.** The default display at 18 000 h changes nuclei of three real fields (one H-DAB, two H&E) by a ΔE2000 of
4.2 to 6.7 in chroma, 15 to 18 in chroma-luma; 5.1 and 17 are assumed for the paper's images. For the paper's figures
(un-aged, chroma, chroma + luma), this reader expects:

    =====================  ===================  ==================
    quantity               paper                simulated reader
    =====================  ===================  ==================
    mean time, s           41.0, 50.1, 51.2     41.0, 49.9, 51.4
    mean ease              9.7, 8.7, 8.4        9.7, 8.6, 8.4
    agreement, %           69.2, 52.5, 50.0     69.2, 52.5, 50.0
    SD of time, s          17, 24, 21           17, 21, 21
    SD of ease             0.6, 1.6, 1.3        0.6, 1.2, 1.3
    =====================  ===================  ==================

The paper does not state which part of the spread is due to images: the shares below are assumptions. The 18 000 h are
an assumption of lutgen too: the paper does not state the age of its display.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, code_to_linear, delta_e_2000, linear_to_lab
from lutgen.errors import LutgenError
from lutgen.pictures.blocks import code_of, read_field
from lutgen.pictures.nuclei import segment
from lutgen.progress import Progress, unseen
from lutgen.study.answers import Answer
from lutgen.study.protocol import PAPER_CATEGORIES, PAPER_SCALE, Category, Protocol, StudyTrial
from lutgen.study.statistics import UNAGED

#: Condition of the paper → ΔE2000 at nuclei that is assumed for the paper's images: see the calibration above.
PAPER_DIFFERENCES = {"none": 0.0, "chroma": 5.1, "chroma-luma": 17.0}


class Readings(NamedTuple):
    """Answers: seconds, ease, and whether the side of the diagnosis stays the same; arrays of one shape."""

    seconds: Array
    ease: Array
    kept: NDArray[np.bool_]


@dataclass(frozen=True)
class SimulatedReader:
    """A reader whom ΔE at nuclei disturbs; equations and calibration are in the module's docstring."""

    #: Seed of all random numbers: the same seed gives the same answer to each trial, in any order of the trials.
    seed: int = 1
    #: ΔE2000 with a disturbance of 63 %: at ΔE 5.1 agreement falls to Table 3's 52.5 %.
    scale: float = 2.5
    #: Seconds for an un-aged image of average difficulty: with the spreads below, Table 2's mean of 41.0.
    median: float = 37.9
    #: SD of log seconds of a reading and of images (together 0.40, Table 2's 17 s of 41), and of readers (assumed).
    spread: float = 0.31
    spread_images: float = 0.25
    pace: float = 0.2
    #: Increase of log seconds at full disturbance: Table 2's 51.2 / 41.0.
    slowdown: float = 0.225
    #: Ease of reading before it is clipped to 1..10, SD of a reading and of images: Table 2's 9.7, SD 0.6.
    ease_middle: float = 10.59
    ease_spread: float = 1.3
    ease_images: float = 0.5
    #: Loss of ease at full disturbance: Table 2's 8.4 to 8.7.
    ease_loss: float = 2.07
    #: Uncertainty of the diagnosis of an un-aged image (Table 3's 69.23 %), and its spread over images (assumed).
    doubt: float = 0.478
    doubt_images: float = 0.5
    #: Chance to name another category of the same side (assumed). The paper does not count such changes.
    neighbour: float = 0.2
    #: Scales of the study.
    categories: Sequence[Category] = PAPER_CATEGORIES
    ease: tuple[int, int] = PAPER_SCALE

    def disturbance(self, difference: Array | float) -> Array:
        """Return the disturbance, 0..1, by a ΔE2000 ≥ 0 at nuclei."""
        return np.asarray(-np.expm1(-np.asarray(difference) / self.scale))

    def readings(
        self, difference: Array | float, difficulty: Array | float, random: np.random.Generator, pace: float = 0.0
    ) -> Readings:
        """Return the answers for arrays of ΔE2000 at nuclei and of difficulty, which broadcast."""
        difference, difficulty = np.broadcast_arrays(np.asarray(difference, np.float64), np.asarray(difficulty))
        disturbed = self.disturbance(difference)
        log_seconds = np.log(self.median) + pace + self.spread_images * difficulty + self.slowdown * disturbed
        log_seconds = log_seconds + self.spread * random.standard_normal(difference.shape)
        ease = self.ease_middle - self.ease_images * difficulty - self.ease_loss * disturbed
        ease = np.clip(np.rint(ease + self.ease_spread * random.standard_normal(difference.shape)), *PAPER_SCALE)
        surely = np.exp(-self.doubt * np.exp(self.doubt_images * difficulty) - difference / self.scale)
        return Readings(np.exp(log_seconds), ease, random.random(difference.shape) < (1 + surely) / 2)

    def difficulty(self, image: str) -> float:
        """Return the difficulty of an image: a standard normal number."""
        return float(self._random(0, crc32(image.encode())).standard_normal())

    def answer(self, trial: StudyTrial, difference: float, difficulty: float) -> tuple[float, int, str]:
        """Answer one trial with a ``difference`` (ΔE2000) at nuclei: seconds, ease, name of a category."""
        pace = self.pace * float(self._random(1, trial.reader).standard_normal())
        random = self._random(2, trial.reader, trial.session, trial.position)
        read = self.readings(difference, difficulty, random, pace)
        low, high = self.ease
        share = (float(read.ease) - PAPER_SCALE[0]) / (PAPER_SCALE[1] - PAPER_SCALE[0])
        return round(float(read.seconds), 2), round(low + share * (high - low)), self._category(trial, read, random)

    def _category(self, trial: StudyTrial, read: Readings, random: np.random.Generator) -> str:
        settled = self.categories[int(self._random(3, crc32(trial.image.encode())).integers(len(self.categories)))]
        same = [each.name for each in self.categories if each.positive == settled.positive and each != settled]
        across = [each.name for each in self.categories if each.positive != settled.positive]
        wavers, which = random.random() < self.neighbour, random.random()
        if across and not read.kept:
            return across[int(which * len(across))]
        return same[int(which * len(same))] if same and wavers else settled.name

    def _random(self, *stream: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, *stream])


def simulate(
    trials: Iterable[StudyTrial], differences: Mapping[tuple[str, str], float], reader: SimulatedReader
) -> tuple[Answer, ...]:
    """Answer all trials, given (image, condition) → ΔE2000 at nuclei (default 0). Raises LutgenError."""
    for (image, condition), difference in differences.items():
        if not 0 <= difference < float("inf"):
            raise LutgenError(f"ΔE2000 at nuclei of {image} under {condition}: {difference:g} is not 0 or above.")
    positive = {category.name: category.positive for category in reader.categories}
    answers = []
    for trial in trials:
        difference = differences.get((trial.image, trial.condition), 0.0)
        seconds, ease, category = reader.answer(trial, difference, reader.difficulty(trial.image))
        shown = (f"simulated {trial.reader}", trial.session, trial.position, trial.image, trial.condition)
        answers.append(Answer(*shown, seconds, ease, category, positive[category]))
    return tuple(answers)


def nuclear_difference(unaged: Path, aged: Mapping[str, Path]) -> dict[str, float]:
    """Return the mean ΔE2000 over an un-aged picture's nuclei, for each aged one. Raises LutgenError: unreadable."""
    field = read_field(unaged)
    nuclei = segment(field).labels > 0
    before = linear_to_lab(code_to_linear(code_of(field.keys[nuclei])))
    differences = {}
    for condition, path in aged.items():
        other = read_field(path)
        if other.shape != field.shape:
            raise LutgenError(f"{path}: has another size than {unaged}. Restore the study's images.")
        after = linear_to_lab(code_to_linear(code_of(other.keys[nuclei])))
        differences[condition] = float(delta_e_2000(before, after).mean())
    return differences


def measured_differences(study: Path, protocol: Protocol, progress: Progress = unseen) -> dict[tuple[str, str], float]:
    """Return ΔE2000 at nuclei of each image under each aged condition; errors as :func:`nuclear_difference`."""
    files: dict[str, dict[str, Path]] = {}
    for render in protocol.renders:
        files.setdefault(render.image, {})[render.condition] = study / render.file
    differences: dict[tuple[str, str], float] = {}
    images = [image.name for image in protocol.images]
    for done, image in enumerate(images):
        aged = {condition: path for condition, path in files.get(image, {}).items() if condition != UNAGED}
        if aged:
            if UNAGED not in files[image]:
                message = f"{image}: is not shown un-aged in this study, so that its ΔE at nuclei cannot be measured."
                raise LutgenError(f"{message} Give --difference for each aged condition.")
            measured = nuclear_difference(files[image][UNAGED], aged)
            differences |= {(image, condition): value for condition, value in measured.items()}
        progress(done + 1, len(images))
    return differences
