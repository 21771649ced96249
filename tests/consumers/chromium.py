"""Chromium shows pictures with embedded profiles."""

import base64
import re
from collections.abc import Iterator, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lutgen.lint.finding import CHROMIUM, READS, WRONG
from tests.browser import CHROMIUM as BROWSER
from tests.browser import browser
from tests.consumers import Claim, Consumer, Job, Picture, Unavailable, module, run
from tests.consumers._claims import aged, beyond, profile, unlike
from tests.profile_cases import CASES, PIXELS, Case, profile_of


@cache
def version() -> str:
    if BROWSER is None:
        raise Unavailable("chromium is not on PATH; Debian has it in the package chromium")
    # Debian's script first prints warnings about the machine's settings.
    match = re.search(r"Chrom\w* ([\d.]+)", run(BROWSER, "--version"))
    return match[1] if match else "of no version"


def shown(folder: Path, pictures: Sequence[tuple[NDArray[np.uint8], bytes]]) -> list[NDArray[np.uint8]]:
    """Return the pixels that the window shows of pictures with profiles, one below another."""
    images = module("PIL.Image", "pillow")
    marks = []
    for pixels, data in pictures:
        file = BytesIO()
        images.fromarray(pixels).save(file, "PNG", icc_profile=data)
        marks.append(f'<img src="data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}">')
    page_file = folder / "page.html"
    page_file.write_text(f'<style>img{{display:block}}</style><body style="margin:0">{"".join(marks)}')
    ends = np.cumsum([len(pixels) for pixels, _ in pictures])
    with browser(folder / "profile") as page:
        page.size(max(pixels.shape[1] for pixels, _ in pictures), int(ends[-1]))
        page.open(page_file)
        page.wait("[...document.images].every(image => image.complete && image.naturalWidth)")
        whole = np.asarray(images.open(BytesIO(page.picture())).convert("RGB"))
    rows = np.split(whole[: ends[-1]], ends[:-1])
    return [row[:, : pixels.shape[1]] for row, (pixels, _) in zip(rows, pictures, strict=True)]


def picture(job: Job) -> Picture:
    """Return the image with the embedded profile as the user sees it."""
    folder = job.scratch / "chromium"
    folder.mkdir(exist_ok=True)
    return shown(folder, [(job.image, job.lut("icc").read_bytes())])[0]


def on_an_aged_display(case: Case) -> bytes:
    """Put the fault into the profile of an aged display, so that an ignored profile is visible."""
    whole, data = case.whole, case.data
    profile_of_it = bytearray(profile_of(case.form, 18_000))
    for place in range(min(len(data), len(whole))):
        if data[place] != whole[place]:
            profile_of_it[place] = data[place]
    return bytes(profile_of_it[: len(data)]) + bytes(max(0, len(data) - len(whole)))


def faulty_profiles(folder: Path) -> Iterator[str]:
    pictures = [(PIXELS, on_an_aged_display(case)) for case in ASKED.values()]
    for (name, case), seen in zip(ASKED.items(), shown(folder, pictures), strict=True):
        # Chromium accepts every profile: if it cannot use a profile, it shows the picture without the profile.
        yield from unlike(name, WRONG if np.array_equal(seen, PIXELS) else READS, case.outcomes[CHROMIUM])


def aged_colours(folder: Path) -> Iterator[str]:
    """Check that a version 4 table and a matrix are one or two codes off, and a version 2 table more, as lint says."""
    pixels = np.random.default_rng(22).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    pixels[:8] = 255
    limits = {"icc": 1.5, "icc-matrix": 3.0, "icc-v2": 6.0}
    colours = shown(folder, [(pixels, profile(name)) for name in limits])
    meant = aged().code_to_code(pixels / 255) * 255
    for (name, limit), picture in zip(limits.items(), colours, strict=True):
        if not (error := np.quantile(np.abs(picture - meant), 0.99)) < limit:
            yield f"{name}: 99 % of the values within {error:.1f} codes, and {limit:g} are allowed"
        yield from beyond(f"white of {name}", picture[0, :1].astype(float), meant[0, :1], 2.0)


#: Faults of a table alone may not change what an aged table shows at hour 0, so they are not distinguished.
ASKED = {
    name: case for name, case in CASES.items() if case.outcomes[CHROMIUM] == READS or not case.rule.endswith("table")
}

CONSUMERS = [Consumer("Chromium", version, "aged.icc", "trilinear", picture)]

CLAIMS = [
    Claim("Chromium", version, f"reads {len(ASKED)} profiles with faults as lint says", faulty_profiles),
    Claim("Chromium", version, "shows the aged colours of a picture with our profile", aged_colours),
]
