"""Variants of ``.3dl`` files, and the result of each in OpenColorIO and in ffmpeg."""

from collections.abc import Callable

import numpy as np

from lutgen.lint.finding import READS, REFUSES, WRONG

#: Factors of the tables on green and blue; red does not change.
GREEN, BLUE = 0.9, 0.8

PLACES = " ".join(str(min(64 * place, 1023)) for place in range(17))


def mesh(points: int = 17, largest: int = 4095) -> str:
    """Return the rows of a .3dl."""
    axis = np.linspace(0, largest, points)
    return "".join(f"{r:.0f} {g * GREEN:.0f} {b * BLUE:.0f}\n" for r in axis for g in axis for b in axis)


#: A .3dl, and its result in OpenColorIO and in ffmpeg.
MESHES: dict[str, tuple[Callable[[], str], str, str]] = {
    "17 points": (lambda: f"{PLACES}\n{mesh()}", READS, READS),
    "comments": (lambda: f"# a\n\n{PLACES}\n{mesh()}", READS, READS),
    "CRLF": (lambda: f"{PLACES}\n{mesh()}".replace("\n", "\r\n"), READS, READS),
    "CR": (lambda: f"{PLACES}\n{mesh()}".replace("\n", "\r"), WRONG, REFUSES),
    "ours, of 33 points": (lambda: f"{PLACES}\n{mesh(33)}", READS, WRONG),
    "9 points": (lambda: f"{PLACES}\n{mesh(9)}", READS, REFUSES),
    "10 bits": (lambda: f"{PLACES}\n{mesh(largest=1023)}", READS, WRONG),
    "16 bits": (lambda: f"{PLACES}\n{mesh(largest=65535)}", READS, WRONG),
    "no places": (mesh, READS, REFUSES),
    "no places, 33 points": (lambda: mesh(33), READS, WRONG),
    "Lustre's": (lambda: f"3DMESH\nMesh 4 12\n{PLACES}\n{mesh()}\nLUT8\ngamma 1.0\n", READS, REFUSES),
}
