"""Run of a config on the GPU: OpenColorIO's shaders for the config's views, run through EGL without a window.

Viewers draw with these shaders, but certificates are measured with OpenColorIO's CPU renderer. Both receive the same
colours in float32, and their code values are compared. Mesa's llvmpipe runs the shaders without a graphics card.

The shader itself computes the tetrahedral interpolation. It reads four texels at their centres, so that the card's own
trilinear filter has no effect. That filter resolves a 256th of a cell, and a trilinear table would show bands.
"""

import os
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.config import RAW_VIEW, SOURCE
from lutgen.bindings import named_for_ocio, ocio, ocio_errors
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError, in_one_line
from lutgen.processes import in_parallel

#: Maximum difference in code values that a check accepts: a quarter of an 8-bit step.
TOLERANCE = 1e-3

#: Number of colours in a row of the drawn picture. Cards limit pictures to some thousand pixels per side.
_ROW = 512

#: Settings of moderngl's context. The type Any is needed, since moderngl declares the settings as dictionaries.
_EGL: dict[str, Any] = {"standalone": True, "require": 400, "backend": "egl"}

#: Shaders that draw one triangle over the picture, and apply OpenColorIO's function to each pixel.
_VERTEX = """#version 400
in vec2 corner;
void main() { gl_Position = vec4(corner, 0.0, 1.0); }
"""
_FRAGMENT = """#version 400
uniform sampler2D colours;
out vec4 shown;
{ocio}
void main() {{ shown = OCIOMain(texelFetch(colours, ivec2(gl_FragCoord.xy), 0)); }}
"""


@dataclass(frozen=True)
class Difference:
    """Difference of GPU and CPU over many colours, in code values 0..1: 99 % quantile and maximum of the channels."""

    p99: float
    max: float


@dataclass(frozen=True)
class GpuRun:
    """The result of a config's shaders on one renderer. Keys of ``views`` are "display, view"."""

    renderer: str
    views: dict[str, Difference]

    @property
    def worst(self) -> float:
        """The largest difference; NaN when a shader gives NaN."""
        return float(np.max([view.max for view in self.views.values()]))

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON data with two digits. Further digits depend on the driver."""
        views = {
            name: {key: float(f"{value:.1e}") for key, value in asdict(view).items()}
            for name, view in self.views.items()
        }
        return {"renderer": self.renderer, "views": views}


def gpu_run(config: Path, code: Array) -> GpuRun:
    """Draw colours (n, 3) through every view of a config except Raw, and compare with OpenColorIO's CPU renderer.

    Raises LutgenError: moderngl, EGL or a driver is missing, or OpenColorIO cannot create the config's processors.
    """
    lib = ocio()
    renderer = renderer_name()
    lib.ClearAllCaches()
    views = {}
    try:
        loaded = lib.Config.CreateFromFile(named_for_ocio(config))
        for display in loaded.getDisplays():
            for view in loaded.getViews(display):
                if view != RAW_VIEW:
                    step = lib.DisplayViewTransform(SOURCE, display, view)
                    views[f"{display}, {view}"] = difference(loaded.getProcessor(step), code)
    except ocio_errors() as error:
        message = f"{config}: OpenColorIO {lib.__version__} makes no shader of it: {in_one_line(error)}"
        raise LutgenError(message) from None
    return GpuRun(renderer, views)


def difference(processor: Any, code: Array) -> Difference:
    """Compare the results of an OpenColorIO processor for colours (n, 3) on GPU and CPU, clipped to 0..1."""
    colours = np.ascontiguousarray(code, dtype=np.float32)
    drawn, computed = drawn_by_gpu(processor, colours), colours.copy()
    processor.getDefaultCPUProcessor().applyRGB(computed)
    away = np.abs(np.clip(drawn, 0.0, 1.0) - np.clip(computed, 0.0, 1.0)).max(axis=1)
    return Difference(float(np.quantile(away, 0.99)), float(away.max()))


def drawn_by_gpu(processor: Any, code: NDArray[np.float32]) -> NDArray[np.float32]:
    """Draw colours (n, 3) through a processor's shader into a picture of floats; return float32, (n, 3)."""
    lib, context = ocio(), _context_in(os.getpid())
    shader = lib.GpuShaderDesc.CreateShaderDesc(language=lib.GPU_LANGUAGE_GLSL_4_0)
    processor.getDefaultGPUProcessor().extractGpuShaderInfo(shader)
    if list(shader.getTextures()):
        raise LutgenError("its shader reads a 1D table. lutgen writes no 1D tables and does not support them here.")
    rows = -(-len(code) // _ROW)
    pixels = np.zeros((rows * _ROW, 4), dtype=np.float32)
    pixels[: len(code), :3] = code
    with ExitStack() as owned:

        def released_at_end(resource: Any) -> Any:
            owned.callback(resource.release)
            return resource

        fragment = _FRAGMENT.format(ocio=shader.getShaderText())
        program = released_at_end(context.program(vertex_shader=_VERTEX, fragment_shader=fragment))
        source = released_at_end(context.texture((_ROW, rows), 4, pixels.tobytes(), dtype="f4"))
        target = released_at_end(context.texture((_ROW, rows), 4, dtype="f4"))
        frame = released_at_end(context.framebuffer([target]))
        source.use(0)
        program["colours"] = 0
        for unit, table in enumerate(shader.get3DTextures(), start=1):
            size, values = table.edgeLen, np.asarray(table.getValues(), dtype=np.float32)
            texture = released_at_end(context.texture3d((size, size, size), 3, values.tobytes(), dtype="f4"))
            texture.repeat_x = texture.repeat_y = texture.repeat_z = False
            texture.use(unit)
            program[table.samplerName] = unit
        corners = released_at_end(context.buffer(np.array([-1, -1, 3, -1, -1, 3], dtype=np.float32).tobytes()))
        triangle = released_at_end(context.vertex_array(program, [(corners, "2f", "corner")]))
        frame.use()
        triangle.render(vertices=3)
        drawn = np.frombuffer(target.read(), dtype=np.float32)
    return drawn.reshape(-1, 4)[: len(code), :3]


def renderer_name() -> str:
    """Return OpenGL's name of the renderer. Raises LutgenError when there is no renderer."""
    return str(_context_in(os.getpid()).info["GL_RENDERER"])


def check_renderer() -> None:
    """Raise LutgenError when no shader can be run. The test uses other processes: a context does not survive a fork."""
    _moderngl()
    list(in_parallel(_renderer_names, [0, 1], 2))


def _renderer_names(_item: int) -> str:
    return renderer_name()


@cache
def _context_in(_process: int) -> Any:
    """Return the context of this process. The process that draws must create its own context."""
    moderngl = _moderngl()
    try:
        return moderngl.create_context(**_EGL)
    except BaseException as error:
        # glcontext raises a plain Exception, not a subclass, for every error of EGL.
        if type(error) is not Exception and not isinstance(error, OSError):
            raise
        raise LutgenError(
            f"no OpenGL 4.0 through EGL here ({in_one_line(error)}), so no shader can be run. Install a "
            f"driver; without a graphics card Debian's libegl1 and libgl1-mesa-dri will do."
        ) from None


def _moderngl() -> Any:
    try:
        return import_module("moderngl")
    except ImportError as error:
        raise LutgenError(f"running shaders needs moderngl ({error}). `pip install lutgen[gpu]`.") from None
