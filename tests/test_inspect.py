"""Statements on a session, against an exactly known display and against the notes of real sessions' authors."""

from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from jsonschema.exceptions import ValidationError

from lutgen import LutgenError
from lutgen.cli.outputs import write_json
from lutgen.colorimetry import SRGB_XY, xy_to_uv
from lutgen.history import Inspection, inspect_session
from lutgen.history.patches import GAMUTS, _covered
from lutgen.history.transfer import native_gamma, native_ramp
from lutgen.readings import read_session
from lutgen.report.inspection import headline, inspect_page, picture_names, plot_inspection
from tests.quick import mostly_slow
from tests.real_data import real_data
from tests.schemas import validator
from tests.session_files import DRIVE, GAMMA, LEAK, WHITE_CD_M2, curves, light, ti3

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

ROOT = Path(__file__).parents[1]


def inspected(folder: Path, text: str, name: str = "session.ti3") -> Inspection:
    (folder / name).write_text(text)
    return inspect_session(read_session(folder / name))


def changed(folder: Path, xyz: Array, drive: Array = DRIVE, **options: Any) -> Inspection:
    return inspected(folder, ti3(drive, 100.0 * xyz, **options))


def test_a_known_display_is_described_exactly(tmp_path: Path) -> None:
    inspection = inspected(tmp_path, ti3())
    assert inspection.white is not None
    assert inspection.black is not None
    assert inspection.white[1] == pytest.approx(WHITE_CD_M2)
    assert inspection.black[1] == pytest.approx(LEAK * WHITE_CD_M2, rel=1e-5)
    assert inspection.contrast == pytest.approx(1.0 / LEAK, rel=1e-5)
    assert inspection.gamma == pytest.approx(GAMMA, abs=1e-4)
    assert {name: round(curve.gamma or 0.0, 3) for name, curve in inspection.curves.items()} == dict.fromkeys(
        inspection.curves, GAMMA
    )
    assert inspection.curves["grey"].residual == pytest.approx(0.0, abs=1e-4)
    assert inspection.additivity == pytest.approx(1.0, abs=1e-6)
    assert inspection.greys is not None
    assert inspection.greys.delta_e.max() < 0.01
    steadiness = inspection.steadiness
    assert steadiness is not None
    assert (steadiness.patches, steadiness.readings, steadiness.dark_noise) == (1, 3, 0.0)
    assert steadiness.noise < 1e-9


def test_the_primaries_are_srgbs_but_for_the_black_that_leaks(tmp_path: Path) -> None:
    primaries = inspected(tmp_path, ti3()).primaries
    assert primaries is not None
    assert primaries.nearest == "sRGB/Rec.709"
    assert max(primaries.shift["sRGB/Rec.709"].values()) < 0.02
    black = changed(tmp_path, light() - light()[1]).primaries
    assert black is not None
    np.testing.assert_allclose([*black.xy.values()], SRGB_XY[1:], atol=1e-5)
    assert black.coverage == pytest.approx(1.0, abs=1e-3)


def test_a_black_within_the_scatter_of_dark_patches_has_no_contrast(tmp_path: Path) -> None:
    drive, scatter = np.vstack([DRIVE, np.zeros((4, 3))]), 3.0 * LEAK * np.array([1.0, -1.0, 1.0, -1.0])
    xyz = light(drive)
    xyz[-4:] += scatter[:, np.newaxis] * xyz[:1]
    inspection = changed(tmp_path, xyz, drive)
    assert inspection.steadiness is not None
    assert inspection.steadiness.dark_noise is not None
    assert inspection.contrast is None
    assert any("below the sensitivity of the meter; contrast is unknown" in each for each in inspection.remarks)


def test_the_scatter_of_a_repeated_dark_grey_does_not_hide_black(tmp_path: Path) -> None:
    drive = np.vstack([DRIVE, np.full((4, 3), 0.25)])
    xyz = light(drive)
    xyz[-4:] *= 1.0 + 0.1 * np.array([[1.0], [-1.0], [1.0], [-1.0]])
    inspection = changed(tmp_path, xyz, drive)
    assert inspection.steadiness is not None
    assert (inspection.steadiness.dark_noise or 0.0) > LEAK * WHITE_CD_M2
    assert inspection.contrast == pytest.approx(1.0 / LEAK, rel=1e-5)


def test_few_levels_are_told_from_none(tmp_path: Path) -> None:
    ramp = np.array([[level, 0.0, 0.0] for level in (0.25, 0.5, 0.75)])
    drive = np.vstack([np.eye(3), np.ones((1, 3)), np.zeros((1, 3)), ramp])
    missing = changed(tmp_path, light(drive), drive).missing
    assert "No ramp of green, blue: no γ of these channels alone." in missing
    assert "Fewer than 5 levels of red below full drive: a coarse γ of these channels." in missing
    assert any(each.startswith("Fewer than 5 greys below white") for each in missing)


def test_deviation_from_srgb_is_that_of_gamma_2_2(tmp_path: Path) -> None:
    curve = inspected(tmp_path, ti3()).curves["grey"]
    place = int(np.argmin(np.abs(curve.drive - 0.1)))
    # At code 0.1: sRGB 0.010023, L* 9.05; γ 2.2 0.0063096, L* 5.70 (CIE 15: 903.3 Y below 0.008856).
    assert curve.lightness[place] == pytest.approx(903.3 * 0.0063096 - (116 * 0.010023 ** (1 / 3) - 16), abs=0.02)


def test_gamma_is_the_slope_that_a_twin_finds(tmp_path: Path) -> None:
    bent = DRIVE ** np.array([2.0, 2.2, 2.5])
    inspection = changed(tmp_path, bent @ (light(np.eye(3)) - LEAK * light(np.ones((1, 3)))) + light()[1])
    for name, gamma in zip(("red", "green", "blue"), (2.0, 2.2, 2.5), strict=True):
        assert inspection.curves[name].gamma == pytest.approx(gamma, abs=2e-3)
    assert any("Channels differ" in remark for remark in inspection.remarks)


def test_what_calibration_holds_back_is_told_from_its_curves(tmp_path: Path) -> None:
    ends = np.array([1.0, 0.9, 0.8])
    inspection = changed(tmp_path, light(DRIVE * ends), calibration=curves(*ends))
    loop = inspection.calibration
    assert loop is not None
    assert loop.at_stop == ("red",)
    assert loop.target == {"x": 0.3127, "y": 0.329, "Y": 180.0}
    # Luminance is 0.2126, 0.7152, 0.0722 of the primaries' (IEC 61966-2-1). The calibration keeps γ 2.2 of each end.
    kept = np.array([0.2126, 0.7152, 0.0722]) @ ends**2.2
    assert loop.cost == pytest.approx(1.0 - kept, abs=1e-3)
    for name in ("red", "green", "blue"):
        assert native_gamma(inspection.session, name) == pytest.approx(2.2, abs=1e-2)
    drive, _ = native_ramp(inspection.session, "blue")
    assert drive[-1] == pytest.approx(0.8)
    assert any("red at the limit" in remark for remark in inspection.remarks)
    assert any("The calibration costs" in remark for remark in inspection.remarks)
    assert any("asked for 180" in remark for remark in inspection.remarks)


def test_a_display_that_brightens_while_it_is_read_is_called_unsteady(tmp_path: Path) -> None:
    ramp = 1.0 + 0.2 * np.linspace(0.0, 1.0, len(DRIVE))
    inspection = changed(tmp_path, light() * ramp[:, np.newaxis])
    assert inspection.steadiness is not None
    assert inspection.steadiness.drift == pytest.approx(0.2, abs=1e-6)
    assert inspection.remarks[0].startswith("Unsteady: luminance of a repeated patch changed by +20.0 %")
    slight = changed(tmp_path, light() * (1.0 + 0.05 * (ramp - 1.0))[:, np.newaxis])
    assert slight.remarks[0].startswith("Drift: luminance changed by +1.0 %")


def test_noise_is_the_pooled_scatter_of_repeats(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    drive = np.vstack([np.ones((400, 3)), np.zeros((100, 3)), DRIVE])
    noisy = light(drive) * (1.0 + 0.002 * rng.standard_normal((len(drive), 1)))
    steady = changed(tmp_path, noisy, drive).steadiness
    assert steady is not None
    assert steady.noise == pytest.approx(0.002, rel=0.1)
    assert steady.dark_noise == pytest.approx(0.002 * LEAK * WHITE_CD_M2, rel=0.2)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda xyz: xyz * np.where((DRIVE.min(axis=1) == 1), 0.85, 1.0)[:, np.newaxis], "Not additive: white is 0.8"),
        (lambda xyz: xyz + 0.01 * xyz[0], "Contrast is only"),
        (lambda xyz: xyz * (1.0, 1.0, 0.8), "off the calibration's target|off D65"),
        (lambda xyz: xyz * np.where((np.ptp(DRIVE, axis=1) == 0)[:, np.newaxis] & (DRIVE < 0.5), (1.1, 1, 1), 1.0),
         "Greys do not track white"),
        (lambda xyz: xyz ** 1.3, "Transfer: γ"),
    ],
)  # fmt: skip
def test_faults_are_remarked_upon(tmp_path: Path, change: Any, sentence: str) -> None:
    healthy = inspected(tmp_path, ti3())
    assert not [remark for remark in healthy.remarks if any(part in remark for part in sentence.split("|"))]
    changed_xyz = change(light())
    inspection = changed(tmp_path, changed_xyz / changed_xyz[0, 1])
    assert [remark for remark in inspection.remarks if any(part in remark for part in sentence.split("|"))], (
        inspection.remarks
    )


#: Rows to keep, and the figures that cannot be computed without the other rows.
LACKING = {
    "black": (DRIVE.any(axis=1), "No black", {"black", "contrast"}),
    "white": (DRIVE.min(axis=1) < 1, "No white at full drive", {"white", "contrast", "additivity", "gamma"}),
    "red": (~((DRIVE[:, 0] == 1) & (DRIVE[:, 1:] == 0).all(axis=1)), "No red at full drive", {"additivity"}),
    "greys alone": (np.ptp(DRIVE, axis=1) == 0, "No red, green or blue at full drive", {"additivity", "gamut"}),
    "tips alone": (np.isin(np.arange(len(DRIVE)), (0, 14, 19, 24)), "No patch was read twice", {"noise", "gamma"}),
}  # fmt: skip


@pytest.mark.parametrize("name", LACKING)
def test_what_a_session_lacks_is_null_and_named(tmp_path: Path, name: str) -> None:
    kept, remark, null = LACKING[name]
    inspection = inspected(tmp_path, ti3(DRIVE[kept]))
    assert any(sentence.startswith(remark) for sentence in inspection.missing)
    content = inspection.as_json()
    assert {key for key in null if content[key] is not None} == set()
    validator("inspect").validate(plain(inspections_json([inspection])))
    assert [*inspect_page([inspection])]


@pytest.mark.parametrize("name", mostly_slow(LACKING, "tips alone"))
def test_a_session_that_lacks_something_is_drawn(tmp_path: Path, name: str) -> None:
    plot_inspection(inspected(tmp_path, ti3(DRIVE[LACKING[name][0]])), tmp_path / "page.png")
    assert (tmp_path / "page.png").read_bytes().startswith(b"\x89PNG")


def test_a_relative_session_says_that_it_is_one(tmp_path: Path) -> None:
    inspection = inspected(tmp_path, ti3(keywords=()))
    assert inspection.as_json()["unit"] == "relative"
    assert inspection.contrast == pytest.approx(1.0 / LEAK, rel=1e-4)
    assert any(sentence.startswith("No cd/m²") for sentence in inspection.missing)


def test_coverage_is_that_of_triangles_whose_overlap_is_known() -> None:
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert _covered(unit, unit) == pytest.approx(1.0)
    assert _covered(unit[::-1], unit) == pytest.approx(1.0)
    assert _covered(0.5 * unit, unit) == pytest.approx(0.25)
    assert _covered(unit + 2.0, unit) == pytest.approx(0.0)
    assert _covered(unit + np.array([0.5, 0.0]), unit) == pytest.approx(0.25)
    assert _covered(xy_to_uv(GAMUTS["Rec.2020"]), xy_to_uv(GAMUTS["P3"])) == pytest.approx(1.0, abs=0.02)


def inspections_json(inspections: Sequence[Inspection]) -> dict[str, Any]:
    """The JSON that ``lutgen inspect --json`` writes for these sessions."""
    return {"schema": 1, "sessions": [each.as_json() for each in inspections]}


def plain(content: dict[str, Any]) -> Any:
    """The content after a strict JSON reader."""
    text = json.dumps(content, allow_nan=False)
    return json.loads(text)


def test_json_is_as_its_schema_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    inspections = [
        inspected(tmp_path, ti3(calibration=curves(1, 1, 0.9))),
        inspect_session(read_session(ROOT / "examples/session.ti3")),
    ]
    write_json(inspections_json(inspections), "-")
    content = json.loads(capsys.readouterr().out)
    validator("inspect").validate(content)
    first = content["sessions"][0]
    assert {"file", "white", "black", "contrast", "primaries", "gamma", "additivity", "noise", "remarks"} <= {*first}
    assert first["primaries"]["r"].keys() == {"x", "y", "Y"}
    for key, wrong in (("white", 3), ("unit", "nits"), ("readings", 0), ("noise", -1), ("remarks", None)):
        broken = deepcopy(content)
        broken["sessions"][0][key] = wrong
        with pytest.raises(ValidationError):
            validator("inspect").validate(broken)


def test_the_page_is_the_same_bytes_on_every_run_and_never_replaced_unasked(tmp_path: Path) -> None:
    inspection = inspected(tmp_path, ti3(calibration=curves(1, 1, 0.9)))
    plot_inspection(inspection, tmp_path / "a.png")
    plot_inspection(inspection, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with pytest.raises(LutgenError, match="exists already"):
        plot_inspection(inspection, tmp_path / "a.png")
    assert headline(inspection).startswith("invented: white 200 cd/m²")


def test_two_pictures_of_one_name_are_refused() -> None:
    assert picture_names(["a/x.ti3", "a/y.ti3"]) == ["inspect-x.png", "inspect-y.png"]
    of_table = ["a/x.csv, hour 0", "a/x.csv, hour 0.5", "a/x.csv, hour 0, session dark room"]
    assert picture_names(of_table) == [
        "inspect-x-hour-0.png", "inspect-x-hour-0.5.png", "inspect-x-hour-0-session-dark-room.png"
    ]  # fmt: skip
    with pytest.raises(LutgenError, match="two sessions would be drawn"):
        picture_names(["a/x.ti3", "b/x.csv"])


def test_uneven_screens_are_told_from_the_middle(tmp_path: Path) -> None:
    rows = "".join(
        f"0,{r},{c},0,{0.95 * y},{y},{1.09 * y}\n" for r in range(3) for c in range(3) for y in [200 - 20 * r - 10 * c]
    )
    inspection = inspected(tmp_path, f"position,row,col,level_index,X,Y,Z\n{rows}", "u.csv")
    assert inspection.uniformity == pytest.approx((140 / 170, 200 / 170))
    assert "Uneven: over the screen white has 82 % to 118 %" in inspection.remarks[0]
    plot_inspection(inspection, tmp_path / "u.png")


@pytest.fixture(scope="module")
def real() -> dict[str, Inspection]:
    files = [path for path in (real_data() / "real").rglob("*") if path.suffix in {".ti3", ".csv"}]
    return {path.name: inspect_session(read_session(path)) for path in files}


def of(real: dict[str, Inspection], start: str) -> Inspection:
    (name,) = (name for name in real if name.startswith(start))
    return real[name]


def test_real_sessions_say_what_their_authors_noted(real: dict[str, Inspection]) -> None:
    # SOURCES.md: automatic brightness in two MacBook sessions, Windows HDR in one of the K2418U.
    for start in ("MacBook_Pro_13_2013_Late___1_2018-06-03", "MacBook_Pro_13_2013_Late___1_2018-10-02"):
        assert of(real, start).remarks[0].startswith("Unsteady")
    hdr = of(real, "K2418U__2_2021-02-09_09-32").additivity
    assert hdr is not None
    assert hdr < 0.9
    unsteady = [name for name, session in real.items() if session.remarks and session.remarks[0].startswith("Unsteady")]
    assert len(unsteady) == 2
    healthy = of(real, "U2718Q__1_2020-05-26_13-17")
    assert healthy.additivity == pytest.approx(1.0, abs=0.01)
    assert healthy.primaries is not None
    assert healthy.primaries.nearest == "sRGB/Rec.709"
    wrong = of(real, "U2718Q__1_2020-05-26_12-15").primaries
    assert wrong is not None
    assert wrong.shift["sRGB/Rec.709"]["red"] > 3 * healthy.primaries.shift["sRGB/Rec.709"]["red"]


def test_every_real_session_is_as_the_schema_says(real: dict[str, Inspection]) -> None:
    validator("inspect").validate(plain(inspections_json([*real.values()])))


def test_a_session_without_light_is_described_without_a_crash(tmp_path: Path) -> None:
    session = inspected(tmp_path, ti3()).session
    dark = inspect_session(replace(session, xyz=np.zeros_like(session.xyz)))
    assert dark.contrast is None
    assert dark.steadiness is None
    validator("inspect").validate(json.loads(json.dumps(_without_nan(inspections_json([dark])), allow_nan=False)))


def _without_nan(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _without_nan(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_without_nan(value) for value in content]
    return None if isinstance(content, float) and np.isnan(content) else content


@pytest.mark.parametrize(
    ("sent", "says"),
    [
        (np.minimum(DRIVE, 0.8), "Clipped: the same light for grey from code 0."),
        (np.clip((DRIVE - 0.15) / 0.85, 0, 1), "Crushed: no light for grey up to code 0."),
        (DRIVE * [0.9, 1.0, 1.0], ""),
        (DRIVE, ""),
    ],
    ids=["contrast too high", "brightness set too low", "a channel turned down", "a healthy display"],
)
def test_codes_that_are_not_told_apart_are_news(tmp_path: Path, sent: Array, says: str) -> None:
    remarks = [text for text in changed(tmp_path, light(sent)).remarks if text.startswith(("Clipped", "Crushed"))]
    assert [text for text in remarks if says and text.startswith(says)] or (not says and not remarks)
