"""Blender without a window: it saves an image through the scene's view, as its image editor and renders do.

Blender keeps the depth of its input: it rounds an 8-bit picture to 8 bit, whatever the output file's depth.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from lutgen.bake.config import AGED_VIEW, LOOK, SOURCE, UNAGED_VIEW
from lutgen.lint import lint
from tests.consumers import Claim, Consumer, Job, Picture, Unavailable, first_line, program, read_image, run
from tests.consumers._gallery import CASES, Gallery
from tests.consumers.oiiotool import debian, display

#: Runs inside Blender's own Python. Arguments: a source, its colour space, then view, look and result, repeated. Names
#: that the config lacks raise TypeError. Blender adds noise before it rounds, unless dither is 0.
SCRIPT = """
import sys
import bpy
source, space, *wishes = sys.argv[sys.argv.index("--") + 1 :]
scene = bpy.context.scene
scene.render.dither_intensity = 0
scene.render.image_settings.file_format = "PNG"
scene.render.image_settings.color_mode = "RGB"
scene.render.image_settings.color_depth = "16"
scene.display_settings.display_device = "sRGB"
image = bpy.data.images.load(source)
if image.colorspace_settings.name != space:
    sys.exit(f"takes a PNG for {image.colorspace_settings.name}, not {space}")
for view, look, result in zip(*[iter(wishes)] * 3):
    scene.view_settings.view_transform = view
    scene.view_settings.look = look
    image.save_render(result, scene=scene)
"""


def tool() -> str:
    return program("blender", "blender")


@cache
def version() -> str:
    return first_line(run(tool(), "--version")).removeprefix("Blender ")


@cache
def call(source: Path, config: Path, variables: tuple[tuple[str, str], ...] = ()) -> tuple[Path, Path]:
    """Save the image through the view and through the look, in one start of Blender."""
    script = source.with_name("blender_script.py")
    script.write_text(SCRIPT)
    stem = "blender-variables" if variables else "blender"
    results = source.with_name(f"{stem}-view.png"), source.with_name(f"{stem}-look.png")
    flags = ("--background", "--factory-startup", "-noaudio", "--python-exit-code", "3", "--python", script, "--")
    wishes = (AGED_VIEW, "None", results[0], UNAGED_VIEW, LOOK, results[1])
    env = {"OCIO": str(config), **dict(variables)}
    output = run(tool(), *flags, source, SOURCE, *wishes, env=env)
    if f"Using {config}" not in output:
        raise RuntimeError(f"Blender did not take {config}:\n{output}")
    return results


def view(job: Job) -> Picture:
    return read_image(call(job.png16, job.config)[0])


def look(job: Job) -> Picture:
    return read_image(call(job.png16, job.config)[1])


def variables(job: Job) -> Picture:
    return read_image(call(job.png8, job.common_config, tuple(job.variables.items()))[0])


#: Path of Blender's own config in Debian's package.
OWN_CONFIG = Path("/usr/share/blender/datafiles/colormanagement/config.ocio")


def pixels(folder: Path) -> Iterator[str]:
    gallery = Gallery(folder)
    for case in CASES:
        job = gallery.job(case)
        theirs = display(job, debian).astype(int)
        for name, way in (("view", view), ("look", look)):
            # 16 bit: two roundings of the same number may differ by one step.
            if (steps := int(np.abs(way(job).astype(int) - theirs).max())) > 1:
                yield f"{name}, {case}: {steps} steps of 16 bit apart"


def own_config(_folder: Path) -> Iterator[str]:
    if not OWN_CONFIG.is_file():
        raise Unavailable(f"{OWN_CONFIG} is missing; Debian has it in the package blender-data")
    report = lint(OWN_CONFIG, ask_readers=True)
    for finding in report.findings:
        if finding.rule != "config-roles" or finding.level(report.readers) != "note":
            yield f"{finding.rule}: {finding.what}"


CLAIMS = [
    Claim("Blender", version, "shows by view and by look the pixels of oiiotool", pixels),
    Claim("Blender", version, "has a config in which lint finds a note on roles and no fault", own_config),
]

CONSUMERS = [
    Consumer("Blender, view", version, "config.ocio", "tetrahedral", view),
    Consumer("Blender, look", version, "config.ocio", "tetrahedral", look),
    Consumer("Blender, view, env, 8 bit", version, "common config.ocio", "tetrahedral", variables),
]
