"""OpenColorIO configs: lint loads a config and instantiates every part. Rules report what programs do with the parts.

``validate()`` alone is not enough, since it passes when a LUT file is missing.
"""

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lutgen import bindings
from lutgen.bake.formats import lut_suffixes
from lutgen.errors import LutgenError, in_one_line
from lutgen.lint.finding import DJV, OCIO, OCIO_21, READERS, Linted, LintFinding, refused, wrong
from lutgen.lint.formats import FileKind, findings
from lutgen.lint.programs import try_config
from lutgen.lint.stream import readable
from lutgen.numerals import listed

#: Suffixes of the tables that OpenColorIO reads and lutgen does not write.
OTHER_TABLES = (".vf", ".lut", ".mga", ".m3d", ".itx")

EVERYONE = READERS["config"]

#: Maximum number of views that fit into a menu.
MANY = 10

#: Role → its use.
ROLE_USES = {
    "scene_linear": "Blender and Nuke work in it",
    "default": "files without a rule are read as it",
    "color_picking": "Blender's colour picker uses it",
    "texture_paint": "Nuke and Blender paint in it",
    "compositing_log": "Nuke reads log files as it",
    "data": "masks and normals are read as it",
    "aces_interchange": "other configs are connected through it, and later OpenColorIO asks for it",
    "cie_xyz_d65_interchange": "other configs are connected through it, and later OpenColorIO asks for it",
}

#: Maximum size of a config in bytes. The largest published config has 0.5 MB.
MAX_BYTES = 64 << 20


@dataclass(frozen=True)
class ConfigScan:
    """The result of a scan of a config."""

    text: str
    #: The profile version; (0, 0) when the config states none.
    version: tuple[int, int]
    #: OpenColorIO's object; None when it does not load or a name is not UTF-8.
    config: Any
    #: Whether its names and texts are UTF-8.
    decodes: bool
    #: The reason why the installed OpenColorIO does not load or validate it; empty when it is valid.
    refusal: str
    #: The log of OpenColorIO during loading.
    warnings: tuple[str, ...]
    #: Parts that cannot be instantiated, each with the reason.
    broken: tuple[tuple[str, str], ...]

    def line_of(self, words: str) -> int:
        """Return the number of the first line that contains ``words``; 0 for no line."""
        place = self.text.find(words) if words else -1
        return self.text.count("\n", 0, place) + 1 if place >= 0 else 0

    @property
    def file_transforms(self) -> list[Any]:
        """Every FileTransform of the config."""
        return list(bindings.file_transforms(self.config))


def scan_config(path: Path) -> ConfigScan:
    """Load a config and instantiate its parts. Raises LutgenError: it cannot be read, or is larger than any config."""
    with readable(path, "a config"):
        if path.stat().st_size > MAX_BYTES:
            raise LutgenError(f"{path}: has more than {MAX_BYTES >> 20} MiB, which no config has.")
        data = path.read_bytes()
    utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = data.decode("utf-16" if utf16 else "utf-8", errors="replace")
    stated = re.search(r"^ocio_profile_version:\s*[\"']?([0-9]+)(?:\.([0-9]+))?", text, re.MULTILINE)
    version = (int(stated[1][:6]), int((stated[2] or "0")[:6])) if stated else (0, 0)
    lib = bindings.ocio()
    lib.ClearAllCaches()
    broken: list[tuple[str, str]] = []
    config, refusal = None, ""
    with bindings.warnings_logged(lib) as warnings:
        try:
            config = lib.Config.CreateFromFile(bindings.named_for_ocio(path))
            config.validate()
        except bindings.ocio_errors() as error:
            refusal = in_one_line(error)
        decodes = config is None or bindings.is_utf8(config)
        if config is not None and decodes:
            broken = _broken(config)
    if not decodes:
        config, refusal = None, ""
    logged = tuple(dict.fromkeys(warnings))
    return ConfigScan(text, version, config, decodes, refusal, logged, tuple(broken))


def _broken(config: Any) -> list[tuple[str, str]]:
    if endless := bindings.endless_file(config):
        why = f"{endless.name} opens its metadata and never closes them, so that readers never end"
        return [(f"every part that reads {endless.name}", why)]
    works, fails = set(), {}
    try:
        for name, transform in bindings.all_parts(config):
            try:
                config.getProcessor(transform).getDefaultCPUProcessor()
                works.add(name)
            except bindings.ocio_errors() as error:
                fails[name] = in_one_line(error)
    except LutgenError as error:
        fails["the whole config"] = str(error)
    # A colour space that converts in one direction only is valid. Many colour spaces of displays do so.
    return [(name, why) for name, why in fails.items() if name not in works]


def config_version(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find versions after 2.1, which OpenColorIO 2.1 refuses. Any other refusal counts for all readers."""
    line = scan.line_of("ocio_profile_version")
    installed = str(bindings.ocio().__version__)
    if scan.version == (0, 0) and not scan.refusal:
        fates = wrong(*EVERYONE, how="reads it as an empty config")
        yield LintFinding("states no ocio_profile_version, so it is not a config", "Export it again.", 0, fates)
    elif scan.version > (2, 1):
        fates = refused(OCIO_21, how="does not know versions after 2.1")
        if scan.version > (2, 6):
            fates = refused(*EVERYONE, how="does not know this version")
        fact = f"asks for profile version {_version_text(scan)}"
        yield LintFinding(fact, "Write 2.1 where nothing newer is used.", line, fates)
    too_new = scan.version > (2, 6) or (scan.version > (2, 1) and installed.startswith("2.1."))
    if scan.refusal and not too_new:
        fact = f"does not load: {scan.refusal[:300]}"
        fates = refused(*EVERYONE, how=f"OpenColorIO {installed} was tried")
        yield LintFinding(fact, "Correct it; `lutgen lint --try` asks ociocheck.", 0, fates)


def _version_text(scan: ConfigScan) -> str:
    return ".".join(map(str, scan.version))


def config_parts(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find parts that cannot be instantiated. A user who chooses one gets an error, and Debian's oiiotool aborts."""
    reasons: dict[str, list[str]] = {}
    for part, reason in scan.broken:
        reasons.setdefault(reason.partition(" The following attempts")[0], []).append(part)
    for reason, parts in reasons.items():
        missing = "could not be located" in reason
        yield LintFinding(
            f"{listed(parts, 3)} cannot be shown: {reason[:200]}",
            "Put the file on the search path." if missing else "Correct it or remove it.",
            scan.line_of(reason.split("'")[1]) if reason.count("'") > 1 else 0,
            refused(*EVERYONE, how="stops with an error when it is chosen"),
        )


def config_files(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find paths that work in this folder only, and tables without an interpolation: notes, since the config works."""
    files = [transform.getSrc() for transform in scan.file_transforms]
    absolute = [each for each in [*files, *bindings.search_path(scan.config)] if Path(each).is_absolute()]
    if absolute:
        fact = f"names {absolute[0]} by an absolute path: it works on this machine only"
        yield LintFinding(fact, "Name it relative to the config.", scan.line_of(absolute[0]))
    outside = [each for each in bindings.search_path(scan.config) if bindings.leads_out(each)]
    if outside:
        fact = f"searches {outside[0]}, outside its folder: moving the folder breaks it"
        yield LintFinding(fact, "Keep LUT files below the config.", scan.line_of(outside[0]))
    # A .spimtx and a .cc have no table, and a CLF states its own interpolation.
    unsaid = (*(suffix for suffix in lut_suffixes() if suffix != ".clf"), *OTHER_TABLES)
    tables = [each for each in scan.file_transforms if each.getSrc().lower().endswith(unsaid)]
    # The text of the object, since its method returns the same value for "default" and for no interpolation.
    texts = [(each.getSrc(), str(each)) for each in tables]
    unstated = [file for file, text in texts if "interpolation" not in text or "interpolation=default" in text]
    if unstated:
        better = "OpenColorIO then takes trilinear, and tetrahedral follows the grey axis of a 3D table better"
        fact = f"states no interpolation for {unstated[0]}: {better}"
        yield LintFinding(fact, "Add interpolation: tetrahedral for 3D tables.", scan.line_of(unstated[0]))


def config_environment(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find context variables. A variable without a default is an error in each program that does not set it."""
    sources = [*(each.getSrc() for each in scan.file_transforms), *scan.config.getSearchPaths()]
    used = {name: text for text in sources for name in re.findall(r"[$%]\{?(\w+)", text)}
    without = [name for name in used if not scan.config.getEnvironmentVarDefault(name)]
    if without:
        fact = f"chooses files by the variable {without[0]}, which has no default"
        yield LintFinding(fact, "Give it one under environment.", scan.line_of(used[without[0]]))
    elif used:
        fact = f"chooses files by the variable {min(used)}: programs that cannot set it show its default"
        yield LintFinding(fact, "Give those programs a config of their own.", scan.line_of(used[min(used)]))


def config_keys(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find unknown keys, such as misspelt keys. OpenColorIO skips them with a warning."""
    for warning in scan.warnings:
        quoted = warning.split("'")[1] if warning.count("'") > 1 else ""
        fact = f"OpenColorIO warns: {warning[:200]}"
        yield LintFinding(fact, "Correct the word, or remove it.", scan.line_of(quoted))


def config_roles(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find missing roles. The findings are notes, since programs then choose another colour space."""
    expected = {role: why for role, why in ROLE_USES.items() if scan.version >= (2, 0) or "interchange" not in role}
    missing = {role: why for role, why in expected.items() if not scan.config.hasRole(role)}
    if missing:
        roles = "; ".join(f"{role} ({why})" for role, why in missing.items())
        yield LintFinding(f"has no role {roles}", "Add them under roles.", scan.line_of("roles:"))
    default = scan.config.getColorSpace("default") if scan.config.hasRole("default") else None
    if default is not None and default.isData():
        fact = "has a data space as its default: views show files without a rule unchanged, without an error"
        remedy = "Make the role default a colour space with colours."
        yield LintFinding(fact, remedy, scan.line_of("default:"))


def config_views(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find too many views, and views with looks, which DJV ignores."""
    pairs = [(display, view) for display in scan.config.getDisplays() for view in scan.config.getViews(display)]
    if len(pairs) > MANY:
        fact = f"has {len(pairs)} views on its displays: Nuke lists every one"
        yield LintFinding(fact, "Keep ten or fewer active.", scan.line_of("displays:"))
    looks = [pair for pair in pairs if scan.config.getDisplayViewLooks(*pair)]
    if looks:
        display, view = looks[0]
        fact, fates = f"has looks in the view {view} of {display}", wrong(DJV, how="ignores looks")
        remedy = "For DJV, build the look into a colour space or a view transform."
        yield LintFinding(fact, remedy, scan.line_of("looks:"), fates)


def config_encoding(scan: ConfigScan) -> Iterator[LintFinding]:
    """Find bytes that are not UTF-8. OpenColorIO accepts them, but its Python binding fails on names and texts."""
    # Decoding has replaced bytes that are not UTF-8 by this character.
    line = scan.line_of("\ufffd")
    if not scan.decodes:
        fates = refused(*OCIO, how="its Python binding raises UnicodeDecodeError")
        yield LintFinding("has names or texts that are not UTF-8", "Save it as UTF-8.", line, fates)
    elif line and scan.config is not None:
        yield LintFinding("has comments that are not UTF-8", "Save it as UTF-8.", line)


#: Rules on a config that OpenColorIO has loaded, and all rules.
OF_LOADED = (config_files, config_environment, config_roles, config_views)
RULES = (config_version, config_encoding, config_parts, config_keys, *OF_LOADED)


def lint_config(path: Path, ask_readers: bool) -> Linted:
    """Lint a config. Raises LutgenError when it cannot be read, or is larger than any config."""
    scan = scan_config(path)
    trials = (try_config(path),) if ask_readers else ()
    rules = [rule for rule in RULES if scan.config is not None or rule not in OF_LOADED]
    return Linted(path, "config", (f"profile version {_version_text(scan)}",), tuple(findings(rules, scan)), trials)


FORMAT = FileKind((".ocio",), lint_config, RULES)
