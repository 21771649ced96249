"""G'MIC's ``map_clut`` on a .cube: the guide says that it shows every .cube wrongly, even an identity."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Lut
from lutgen.bake.spaces import lattice
from tests.consumers import Claim, Unavailable, program, read_image, run, write_image

#: Range of an identity's error in codes of 8 bits, according to the guide.
SAID = 4, 6


def tool() -> str:
    return program("gmic", "gmic")


@cache
def version() -> str:
    match = re.search(r"Version ([\d.]+)", run(tool(), "-version"))
    if match is None:
        raise Unavailable("gmic does not tell its version")
    return match[1].rstrip(".")


def identity(folder: Path) -> Iterator[str]:
    """Apply a table that changes no colour."""
    table = Lut("code", lattice(33, "code").reshape(33, 33, 33, 3))
    (folder / "same.cube").write_bytes(format_named("cube").write(table, Provenance("same", "same", ())))
    pixels = np.random.default_rng(5).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    write_image(folder / "in.png", pixels)
    run(tool(), folder / "in.png", folder / "same.cube", "-map_clut[0]", "[1]", "-output[0]", folder / "out.png")
    worst = np.abs(read_image(folder / "out.png").astype(float) - pixels).max()
    if not SAID[0] <= worst <= SAID[1]:
        yield f"an identity is {worst:g} codes off"


CLAIMS = [Claim("G'MIC map_clut", version, "is 4 to 6 codes off with a .cube that is an identity", identity)]
