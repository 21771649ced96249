"""Sealed data sets: CSV files under random names, and the answers in ``answers.json``. Only scoring opens them.

Each answer contains the whole campaign, the hidden truth, its strength in units of the smallest detectable size
(strength 6.5), and the honest replies. The honest replies are a list of ``{"verdict": [...]}`` with optional
``effects`` (exactly these), ``contains`` (these among others), ``at_most`` (maximum number of names) and ``unseen``
(listed as not visible).
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.virtual_display import blind, broken
from tests.virtual_display.campaign import Campaign, csv_text
from tests.virtual_display.physics import EFFECTS, find, names
from tests.virtual_display.spectra import CLASSES
from tests.virtual_display.strength import DETECTABLE, Sized, sized, strength

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

ANSWERS = "answers.json"

#: Multiples of the smallest detectable size, by the name of the band.
BANDS = {"1-3": (1.0, 3.0), "3-10": (3.0, 10.0)}

#: Two effects that one display can plausibly have, and the reason.
PAIRS = {
    ("black-level", "eotf-drift"): "an old panel leaks and its liquid crystal's curve has moved",
    ("black-level", "edge-falloff"): "a sagging diffuser darkens edges, polarisers fade",
    ("black-level", "warm-up"): "an old lamp behind an old panel",
    ("crosstalk", "edge-falloff"): "a cheap panel with a cheap backlight",
    ("primary-shift", "warm-up"): "a TN panel with a fluorescent lamp",
    ("eotf-drift", "ambient-reflection"): "measured in the reading room, not in the dark",
    ("channel-gamma", "loading"): "one driver ages, and the supply is weak",
    ("temperature", "warm-up"): "the same lamp, by two causes of heat",
    ("recalibration", "edge-falloff"): "somebody calibrated an uneven display",
    ("meter-offset", "crosstalk"): "a meter without dark correction on an ordinary panel",
    ("loading", "veiling-glare"): "a bright surround dims the patch and strays into the lens",
    ("quantization", "black-level"): "an 8-bit panel that leaks",
}

#: For an effect outside the catalogue: the family of which it is a refined form. The verdict ``form`` for this family
#: counts as honest.
KIN = {"blue-run-in": "warm-up", "dynamic-dimming": "dynamic-contrast", "room-sensor": "ambient-reflection"}

#: Number of names that the data of ``first-hour`` sets cannot always distinguish.
TIED = 3


@dataclass(frozen=True)
class Sealed:
    """One data set: its text, and the information for scoring."""

    text: str
    answer: dict[str, Any]


def make(folder: Path, *, seed: int, counts: Mapping[str, int], noise: str, design: str = "full") -> None:
    """Write ``counts[kind]`` data sets of each kind at one noise level, and their answers, into ``folder``.

    If the folder already has answers, the new data sets are added, so that one folder holds several noise levels.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / ANSWERS
    answers: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    for kind, count in counts.items():
        rng = np.random.default_rng([seed, *noise.encode(), *kind.encode()])
        start = int(rng.integers(1 << 16))
        for number in range(count):
            base = Campaign(design=design, noise=noise, seed=int(rng.integers(1 << 31)), held=bool(rng.integers(2)))
            sealed = KINDS[kind](base, start + number, rng)
            name = f"{rng.integers(1 << 40):010x}.csv"
            (folder / name).write_text(sealed.text, encoding="utf-8")
            answers[name] = {"kind": kind, "noise": noise, **sealed.answer}
    path.write_text(json.dumps(answers, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def campaign_of(answer: Mapping[str, Any]) -> Campaign:
    """Return the campaign that an answer describes."""
    settings = dict(answer["campaign"])
    for name in ("hidden", "metadata"):
        settings[name] = tuple(tuple(item) for item in settings[name])
    return Campaign(**settings | {"hours": tuple(settings["hours"])})


def _sealed(campaign: Campaign, honest: list[dict[str, Any]], **more: Any) -> Sealed:
    truth = [name for name, _, _ in campaign.hidden]
    answer = {"truth": truth, "honest": honest, "without": [], "campaign": asdict(campaign), **more}
    return Sealed(answer.pop("text", None) or csv_text(campaign), answer)


def right_family(*truth: str, at_most: int = 2) -> list[dict[str, Any]]:
    """Return the replies that name the truth: directly, by its family, or in a small set."""
    if len(truth) > 1:
        return [{"verdict": ["several"], "effects": sorted(truth)}]
    exact = {"verdict": ["named", "form"], "effects": list(truth)}
    return [exact, {"verdict": ["one-of"], "contains": list(truth), "at_most": at_most}]


def _null(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    del rng
    display = list(CLASSES)[number % len(CLASSES)]
    return _sealed(replace(base, display=display), [{"verdict": ["consistent"]}])


def _hard_null(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """Strong aging that tips absorb; in every second set the meter drifts as well."""
    del rng
    drift = (("meter-drift", 0.02, "same"),) if number % 2 else ()
    campaign = replace(base, display=list(CLASSES)[number // 2 % len(CLASSES)], ageing=1.5, hidden=drift)
    return _sealed(campaign, [{"verdict": ["consistent"]}])


def _with_effect(
    base: Campaign, name: str, form: str, target: float, rng: np.random.Generator
) -> tuple[Campaign, Sized]:
    effect = find(name, form)
    campaign = replace(base, display=str(rng.choice(effect.classes)), baseline=effect.baseline)
    solved = sized(campaign, name, form, target)
    return replace(campaign, hidden=((name, solved.size, form),)), solved


def _multiple(band: str, rng: np.random.Generator) -> float:
    low, high = BANDS[band]
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _one(form: str, *, baseline: str = "colour-points", at_most: int = 2) -> Callable[..., Sealed]:
    """One effect in the given form; weak (1–3×) and strong (3–10×) sets alternate."""

    def kind(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
        choice = names(baseline=baseline)
        name = choice[number // 2 % len(choice)]
        band = list(BANDS)[number % 2]
        campaign, solved = _with_effect(base, name, form, DETECTABLE * _multiple(band, rng), rng)
        honest = right_family(name, at_most=at_most)
        return _sealed(campaign, honest, band=band, multiple=round(solved.strength / DETECTABLE, 3))

    return kind


def _fresh(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """Aging itself, visible only against the hour-0 display; both forms alternate."""
    form = ("same", "other")[number // (2 * len(names(baseline="first-hour"))) % 2]
    return _one(form, baseline="first-hour", at_most=TIED)(base, number, rng)


def _real_size(name: str, form: str, rng: np.random.Generator) -> float:
    """0.5 to 1.5 times the typical size. Quantization has 7 to 9 whole bits."""
    if name == "quantization":
        return float(1.0 / (2 ** rng.integers(7, 10) - 1))
    return find(name, form).typical * float(rng.uniform(0.5, 1.5))


def _typical(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """Another form at the size of real displays, which is often a hundred times the detectable size."""
    name = names()[number % len(names())]
    effect = find(name, "other")
    hidden = ((name, _real_size(name, "other", rng), "other"),)
    campaign = replace(base, display=str(rng.choice(effect.classes)), hidden=hidden)
    return _sealed(campaign, right_family(name), multiple=round(strength(campaign) / DETECTABLE, 3))


def _both(base: Campaign, number: int, rng: np.random.Generator) -> tuple[Campaign, tuple[str, str], tuple[str, str]]:
    """Two effects in random forms, and a display that can have both: campaign, names, forms."""
    pair = list(PAIRS)[number % len(PAIRS)]
    forms = (str(rng.choice(["same", "other"])), str(rng.choice(["same", "other"])))
    classes = [name for name in CLASSES if all(name in find(*both).classes for both in zip(pair, forms, strict=True))]
    return replace(base, display=str(rng.choice(classes))), pair, forms


def _pair(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """Two effects, each at 3–10×."""
    base, pair, forms = _both(base, number, rng)
    solved = [
        sized(base, name, form, DETECTABLE * _multiple("3-10", rng)) for name, form in zip(pair, forms, strict=True)
    ]
    hidden = tuple((name, one.size, form) for name, form, one in zip(pair, forms, solved, strict=True))
    multiples = [round(one.strength / DETECTABLE, 3) for one in solved]
    return _sealed(replace(base, hidden=hidden), right_family(*pair), multiple=multiples)


def _typical_pair(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """Two effects at the sizes of real displays."""
    base, pair, forms = _both(base, number, rng)
    sizes = [_real_size(name, form, rng) for name, form in zip(pair, forms, strict=True)]
    campaign = replace(base, hidden=tuple(zip(pair, sizes, forms, strict=True)))
    return _sealed(campaign, right_family(*pair), multiple=round(strength(campaign) / DETECTABLE, 3))


def _outside(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """An effect outside the catalogue, at 3–10×: every reply is honest except a confident name."""
    choice = sorted(name for name, form in EFFECTS if form == "outside")
    name = choice[number % len(choice)]
    campaign, solved = _with_effect(base, name, "outside", DETECTABLE * _multiple("3-10", rng), rng)
    kin = [{"verdict": ["form"], "effects": [KIN[name]]}] if name in KIN else []
    return _sealed(campaign, [*NOT_CONFIDENT, *kin], multiple=round(solved.strength / DETECTABLE, 3))


def _removed(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """A catalogue effect in another form, at 3–10×, to be diagnosed without its own catalogue entry."""
    name = names()[number % len(names())]
    campaign, solved = _with_effect(base, name, "other", DETECTABLE * _multiple("3-10", rng), rng)
    multiple = round(solved.strength / DETECTABLE, 3)
    return _sealed(campaign, NOT_CONFIDENT, without=[name], multiple=multiple)


#: Replies that name no effect with confidence.
NOT_CONFIDENT: list[dict[str, Any]] = [{"verdict": ["unexplained", "consistent", "one-of", "measurement-problem"]}]


def _blind(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """A design that cannot identify the effect."""
    case = blind.CASES[number % len(blind.CASES)](base, rng)
    return _sealed(case.campaign, case.honest, why=case.why)


def _broken(base: Campaign, number: int, rng: np.random.Generator) -> Sealed:
    """A healthy display with a faulty table."""
    base = replace(base, display=str(rng.choice(list(CLASSES))))
    fault = broken.FAULTS[number % len(broken.FAULTS)](base, rng)
    honest = [{"verdict": ["measurement-problem", "consistent"]}]
    return _sealed(base, honest, text=fault.text, fault=fault.fault, lines=fault.lines, hours=fault.hours)


KINDS: dict[str, Callable[[Campaign, int, np.random.Generator], Sealed]] = {
    "null": _null,
    "hard-null": _hard_null,
    "same-form": _one("same"),
    "other-form": _one("other"),
    "typical": _typical,
    "pair": _pair,
    "typical-pair": _typical_pair,
    "first-hour": _fresh,
    "outside": _outside,
    "removed": _removed,
    "blind": _blind,
    "broken": _broken,
}
