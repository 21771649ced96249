"""darktable's module *LUT 3D* by the command line, with the module's settings in a sidecar file."""

import shutil
import struct
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Sampler
from tests.consumers import Claim, Consumer, Job, Picture, first_line, program, read_image, run, write_image
from tests.consumers._claims import aged, beyond

#: A sidecar that switches on one module, whose settings are bytes in hexadecimal.
_SIDECAR = """<?xml version="1.0" encoding="UTF-8"?>
<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description xmlns:darktable="http://darktable.sf.net/" darktable:xmp_version="5" darktable:raw_params="0"
 darktable:auto_presets_applied="1" darktable:history_end="1"><darktable:history><rdf:Seq>
<rdf:li darktable:num="0" darktable:operation="lut3d" darktable:enabled="1" darktable:modversion="3"
 darktable:params="{settings}" darktable:multi_name="" darktable:multi_priority="0"/>
</rdf:Seq></darktable:history></rdf:Description></rdf:RDF></x:xmpmeta>
"""

#: Version 3 of the settings: the file's name, sRGB, tetrahedral, and an empty packed table with an empty name.
_SETTINGS = struct.Struct("<512s 3i 12288s 128s")


def tool() -> str:
    return program("darktable-cli", "darktable")


@cache
def version() -> str:
    return first_line(run(tool(), "--version")).rpartition(" ")[2]


def shown(picture: Path, lut: Path, folder: Path) -> Picture:
    """Apply a LUT file to a picture, tetrahedral, in sRGB; ``folder`` is a new folder."""
    folder.mkdir()
    sidecar, result = folder / "picture.xmp", folder / "shown.png"
    settings = _SETTINGS.pack(lut.name.encode(), 0, 0, 0, b"", b"").hex()
    sidecar.write_text(_SIDECAR.format(settings=settings), encoding="utf-8")
    own = ("--configdir", folder / "config", "--cachedir", folder / "cache", "--library", ":memory:")
    options = (f"plugins/darkroom/lut3d/def_path={lut.parent}", "plugins/imageio/format/png/bpp=16")
    conf = [word for option in options for word in ("--conf", option)]
    run(tool(), picture, sidecar, result, "--icc-type", "SRGB", "--core", *own, *conf)
    return read_image(result)


def cube(job: Job) -> Picture:
    shutil.rmtree(job.scratch / "darktable", ignore_errors=True)
    return shown(job.png8, job.cube, job.scratch / "darktable")


def curves(folder: Path) -> Iterator[str]:
    """Apply a file of lutgen with a curve before its table; darktable ignores the curve, as lint says."""
    form, picture = format_named("resolve"), folder / "in.png"
    curved = next(lut for lut in form.bake(Sampler(), aged(), 33) if lut.space == "shaped")
    (folder / form.file).write_bytes(form.write(curved, Provenance("Aged display", "lutgen", ())))
    pixels = np.random.default_rng(5).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    write_image(picture, pixels)
    yield from beyond("colours", shown(picture, folder / form.file, folder / "run") / 65_535, pixels / 255, 0.5 / 255)


CLAIMS = [Claim("darktable LUT 3D", version, "shows a picture unchanged with a .cube that has a curve", curves)]

CONSUMERS = [Consumer("darktable LUT 3D", version, "aged.cube", "tetrahedral", cube)]
