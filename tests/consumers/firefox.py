"""Firefox: a picture with lutgen's profile, as a screenshot without a window."""

import re
from functools import cache
from io import BytesIO

import numpy as np

from tests.consumers import Consumer, Job, Picture, Unavailable, module, program, run


@cache
def browser() -> str:
    try:
        return program("firefox", "firefox")
    except Unavailable:
        return program("firefox-esr", "firefox-esr")


@cache
def version() -> str:
    match = re.search(r"Firefox ([\d.]+)", run(browser(), "--version"))
    return match[1] if match else "of no version"


def picture(job: Job) -> Picture:
    """Return the image with the embedded profile as the user sees it."""
    images, file = module("PIL.Image", "pillow"), BytesIO()
    images.fromarray(job.image).save(file, "PNG", icc_profile=job.lut("icc").read_bytes())
    folder = job.scratch / "firefox"
    (folder / "profile").mkdir(parents=True, exist_ok=True)
    (folder / "image.png").write_bytes(file.getvalue())
    page, shot = folder / "page.html", folder / "shot.png"
    page.write_text('<style>img{display:block}</style><body style="margin:0"><img src="image.png">')
    height, width, _ = job.image.shape
    window = (f"--window-size={width},{height}", "--profile", folder / "profile")
    run(browser(), "--headless", "--no-remote", *window, "--screenshot", shot, page.as_uri(), env={"HOME": str(folder)})
    return np.asarray(images.open(shot).convert("RGB"))[:height, :width]


CONSUMERS = [Consumer("Firefox", version, "aged.icc", "trilinear", picture)]
