"""Common LUT Format (Academy S-2014-006, version 3), in the most exact form that the model allows.

- When the four matrices are equal: one matrix between the sRGB curves.
- For ``continuous``, also with effects that only scale, tint and add light: a 2 × 2 × 2 tetrahedral table in linear
  light.
- Otherwise: a table indexed by linear light or by code values, the more faithful of the two.

Aged colours outside sRGB are kept: code values may lie outside 0..1. A program that writes integers clips them.

OpenColorIO's own writers give different bytes in different versions. This module therefore writes the XML itself, and
OpenColorIO reads it back.
"""

from html import escape

from lutgen.bake.digits import rows_of_text
from lutgen.bake.formats import Format, Provenance
from lutgen.bake.lut import Lut, MatrixLut, Sampler, as_matrix, is_tetrahedral
from lutgen.colorimetry import Array
from lutgen.display import AgedDisplay


def candidates(sampler: Sampler, aged: AgedDisplay, size: int) -> list[Lut | MatrixLut]:
    """Return the exact form if one exists, else a table in code values and a table in linear light."""
    matrix = as_matrix(aged)
    if matrix is not None:
        return [matrix]
    if is_tetrahedral(aged):
        return [sampler.lut(aged, 2, "linear", clip=False)]
    return sampler.candidates(aged, size, "code", "linear", clip=False)


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    if isinstance(lut, MatrixLut):
        nodes = _in_linear_light(_matrix(lut.matrix))
    elif lut.space == "linear":
        nodes = _in_linear_light(_table(lut))
    else:
        nodes = [_table(lut)]
    head = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<ProcessList id="{escape(provenance.identifier)}" name="{escape(provenance.title)}" compCLFversion="3.0">',
        *(f"  <Description>{escape(line, quote=False)}</Description>" for line in provenance.lines),
        "  <InputDescriptor>source signal, sRGB code values 0..1</InputDescriptor>",
        "  <OutputDescriptor>aged display, as sRGB code values of an un-aged viewer, not clipped</OutputDescriptor>",
    ]
    parts = ["\n".join(head).encode() + b"\n", *nodes, b"</ProcessList>\n"]
    return b"".join(parts)


def _in_linear_light(node: bytes) -> list[bytes]:
    return [_curve("monCurveFwd"), node, _curve("monCurveRev")]


def _curve(style: str) -> bytes:
    """Return the sRGB curve as CLF's moncurve: exponent 2.4, offset 0.055, linear below its own break point."""
    return (
        f'  <Exponent inBitDepth="32f" outBitDepth="32f" style="{style}">\n'
        f'    <ExponentParams exponent="2.4" offset="0.055"/>\n'
        f"  </Exponent>\n"
    ).encode()


def _matrix(matrix: Array) -> bytes:
    rows = "\n".join(" ".join(f"{value:.10g}" for value in row) for row in matrix)
    return (
        f'  <Matrix inBitDepth="32f" outBitDepth="32f">\n    <Array dim="3 3">\n{rows}\n    </Array>\n  </Matrix>\n'
    ).encode()


def _table(lut: Lut) -> bytes:
    n = lut.size
    head = (
        f'  <LUT3D inBitDepth="32f" outBitDepth="32f" interpolation="tetrahedral">\n    <Array dim="{n} {n} {n} 3">\n'
    )
    # Blue varies fastest in a CLF, and red in the table.
    values = lut.table.transpose(2, 1, 0, 3).reshape(-1, 3)
    return b"".join((head.encode(), rows_of_text(values), b"    </Array>\n  </LUT3D>\n"))


FORMAT = Format(name="clf", suffix=".clf", unclipped=True, write=_write, candidates=candidates)
