"""The package of the users: built, installed elsewhere, and started from another folder."""

import ast
import json
import re
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from email.message import Message
from email.parser import Parser
from importlib.metadata import packages_distributions
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pytest

import lutgen

ROOT = Path(__file__).parents[1]
BINDINGS = {"PyOpenColorIO", "OpenImageIO"}  # Debian's bindings are no distributions; the wheels are an extra
SLOW_TO_IMPORT = {"colour", "matplotlib", "numpy", "rich", "scipy", *BINDINGS}


class Built(NamedTuple):
    sdist: Path
    wheel: Path


class Installed(NamedTuple):
    prefix: Path
    elsewhere: Path

    def run(self, *command: str) -> str:
        """Return the command's output. The command runs in a folder outside the source of lutgen."""
        return run(str(self.prefix / "bin" / command[0]), *command[1:], cwd=self.elsewhere)


def run(*command: str, cwd: Path) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """The sdist, and the wheel built only from the sdist."""
    out = tmp_path_factory.mktemp("dist")
    # The backend is a test dependency: an isolated build would fetch the same backend from the network, twice.
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT), cwd=out)
    (sdist,), (wheel,) = out.glob("*.tar.gz"), out.glob("*.whl")
    return Built(sdist, wheel)


@pytest.fixture(scope="session")
def installed(built: Built, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel in a new environment, which shares the dependencies of this environment."""
    prefix, elsewhere = tmp_path_factory.mktemp("clean"), tmp_path_factory.mktemp("elsewhere")
    bindings = find_spec("PyOpenColorIO")
    debian = bindings is not None and not Path(str(bindings.origin)).is_relative_to(sys.prefix)
    system = ["--system-site-packages"] if debian else []
    run(sys.executable, "-m", "venv", "--without-pip", *system, str(prefix), cwd=elsewhere)
    python = str(prefix / "bin" / "python")
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps")
    run(*pip, "--disable-pip-version-check", str(built.wheel), cwd=elsewhere)
    # A second installation of the dependencies would take half a gigabyte. The test stays valid: Python searches a path
    # in a .pth last, and ignores .pth files inside this path, which point to the working copy. A separate test checks
    # that the package imports only declared dependencies.
    borrowed = Path(sysconfig.get_path("purelib", vars={"base": str(prefix)}), "borrowed.pth")
    borrowed.write_text(sysconfig.get_path("purelib") + "\n")
    return Installed(prefix, elsewhere)


def names_in_sdist(built: Built) -> set[str]:
    with tarfile.open(built.sdist) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


def names_in_wheel(built: Built) -> set[str]:
    with zipfile.ZipFile(built.wheel) as archive:
        return set(archive.namelist())


def metadata(built: Built) -> Message:
    with zipfile.ZipFile(built.wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return Parser().parsestr(archive.read(name).decode())


def working_copy(*patterns: str) -> set[str]:
    files = {path.relative_to(ROOT).as_posix() for pattern in patterns for path in ROOT.glob(pattern)}
    return {name for name in files if "__pycache__" not in name and Path(ROOT, name).is_file()}


def test_make_runs_its_targets_whatever_files_have_their_names() -> None:
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z0-9-]+):", text, re.MULTILINE))
    assert {"test", "lint"} <= targets
    assert set(re.findall(r"^\.PHONY: (.*)$", text, re.MULTILINE)[0].split()) == targets


@pytest.mark.slow
def test_sdist_carries_the_whole_project(built: Built) -> None:
    wanted = working_copy("*.md", "*.cff", "*.yml", "LICENSE", "Makefile", "pyproject.toml", ".ci/*", ".github/**/*")
    wanted |= working_copy("lutgen/**/*", "configs/**/*", "docs/**/*", "tests/**/*", "examples/**/*")
    assert not wanted - names_in_sdist(built)
    assert {"LICENSE", "Makefile", "CHANGELOG.md", "tests/test_package.py"} <= wanted


@pytest.mark.slow
def test_wheel_carries_the_package_and_its_displays_and_nothing_else(built: Built) -> None:
    displays = working_copy("configs/displays/*.csv", "configs/displays/*.toml")
    displays |= {"examples/display-a.csv", "examples/tissue.jpg"}
    assert "configs/displays/reconstructed-ccfl.csv" in displays
    wanted = working_copy("lutgen/**/*") | {f"lutgen/{name}" for name in displays}
    assert {name for name in names_in_wheel(built) if ".dist-info/" not in name} == wanted
    assert "lutgen/py.typed" in wanted


@pytest.mark.slow
def test_wheel_carries_its_licence(built: Built) -> None:
    assert metadata(built)["License-Expression"] == "BSD-3-Clause"
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names_in_wheel(built))


@pytest.mark.slow
def test_every_import_of_the_package_is_a_declared_dependency(built: Built) -> None:
    # The local pages' server is an extra, and the package names the extra if it is missing.
    every = metadata(built).get_all("Requires-Dist", [])
    required = [line for line in every if "extra ==" not in line or "'explore'" in line]
    declared = {re.split(r"[^\w.-]", line, maxsplit=1)[0].lower() for line in required}
    distributions = packages_distributions()
    imported = BINDINGS | {"lutgen"} | sys.stdlib_module_names
    strangers = {
        module: path.relative_to(ROOT).as_posix()
        for path in (ROOT / "lutgen").rglob("*.py")
        for module in top_level_imports(path) - imported
        if not {name.lower() for name in distributions.get(module, [])} & declared
    }
    assert not strangers


def top_level_imports(path: Path) -> set[str]:
    """Top-level names of all absolute imports in a file, also inside functions."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    froms = {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    return {name.partition(".")[0] for name in plain | froms}


@pytest.mark.slow
def test_installed_command_tells_its_version(installed: Installed) -> None:
    assert lutgen.__version__ in installed.run("lutgen", "--version")


@pytest.mark.slow
def test_installed_package_finds_its_own_data_and_not_the_working_copy(installed: Installed) -> None:
    script = """
import importlib.metadata, importlib.resources, json, lutgen
import numpy, OpenImageIO, PyOpenColorIO  # the environment is fit for work
package = importlib.resources.files("lutgen")
first_line = (package / "configs/displays/reconstructed-ccfl.csv").read_text().splitlines()[0]
typed = (package / "py.typed").is_file()
print(json.dumps([lutgen.__file__, importlib.metadata.version("lutgen"), first_line, typed]))
"""
    where, version, first_line, typed = json.loads(installed.run("python", "-c", script))
    assert Path(where).is_relative_to(installed.prefix)
    assert version == lutgen.__version__
    assert "reconstructed" in first_line.lower()
    assert typed


def test_help_gives_every_command_its_whole_first_sentence(tmp_path: Path) -> None:
    help_text = " ".join(run(sys.executable, "-m", "lutgen", "--help", cwd=tmp_path).partition("Simulate:")[2].split())
    assert "Say what each program does with a LUT, profile or config, whoever made it; exit 1 when one" in help_text
    assert "..." not in help_text


def test_help_imports_nothing_slow(tmp_path: Path) -> None:
    script = """
import sys
from lutgen.cli import main
sys.argv = ["lutgen", "--help"]
try:
    main()
finally:
    print("modules:", *sys.modules)
"""
    usage, _, modules = run(sys.executable, "-c", script, cwd=tmp_path).rpartition("modules:")
    assert "Usage: lutgen" in usage
    loaded = {name.partition(".")[0] for name in modules.split()}
    assert "lutgen" in loaded
    assert not loaded & SLOW_TO_IMPORT
