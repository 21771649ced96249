"""three.js in node: its loaders of ``.cube`` and ``.3dl``, which fill the table of a shader."""

import json
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from lutgen.bake.formats import Provenance, format_named
from lutgen.bake.lut import Sampler, table_of
from tests.consumers import TIMEOUT, Claim, Unavailable, program, run
from tests.consumers._claims import aged, beyond

#: Print the size and the numbers of a file's table, each colour with its opacity; red fastest.
_LOAD = """
import { readFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
const [file, loaders, name] = process.argv.slice(1);
const loader = new (await import(pathToFileURL(`${loaders}/${name}.js`)))[name]();
loader.setType(1015);
const { size, texture3D } = loader.parse(readFileSync(file, 'utf8'));
console.log(JSON.stringify([size, Array.from(texture3D.image.data)]));
"""

#: Formats and the tolerance on their numbers: three.js divides the numbers of a .3dl by 4096, and computes in float32.
LIMITS = {"cube": 1.1e-7, "resolve": 1.1e-7, "3dl": 2.6e-4}


@cache
def package() -> str:
    """Return the folder of the package; NODE_PATH contains it."""
    node = program("node", "nodejs")
    try:
        return run(node, "-p", "require('path').resolve(require.resolve('three'), '../..')").strip()
    except RuntimeError:
        raise Unavailable("node finds no three; npm install three, and set NODE_PATH to its node_modules") from None


@cache
def version() -> str:
    return run(program("node", "nodejs"), "-p", f"require({json.dumps(package() + '/package.json')}).version").strip()


def tables(folder: Path) -> Iterator[str]:
    loaders = f"{package()}/examples/jsm/loaders"
    for name, limit in LIMITS.items():
        form = format_named(name)
        loader = "LUT3dlLoader" if name == "3dl" else "LUTCubeLoader"
        for size in (17, 33, 65):
            lut, path = form.bake(Sampler(), aged(), size)[0], folder / form.file
            path.write_bytes(form.write(lut, Provenance("Aged display", "lutgen", ("display: Büro.csv",))))
            command = [program("node", "nodejs"), "--input-type=module", "-e", _LOAD, str(path), loaders, loader]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=TIMEOUT)
            if done.returncode:
                yield f"{name} of {size} points: refused: {done.stderr.strip()[-200:]}"
                continue
            points, numbers = json.loads(done.stdout)
            rgb = np.array(numbers).reshape(-1, 4)[:, :3]
            if points != size:
                yield f"{name} of {size} points: read as one of {points}"
            else:
                yield from beyond(f"{name} of {size} points", rgb, table_of(lut).reshape(-1, 3), limit)


CLAIMS = [
    Claim("three.js", version, "reads the tables of .cube, of .cube for Resolve without a curve, of .3dl", tables)
]
