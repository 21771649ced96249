"""Mixed models: the effect of a condition without the differences between images, readers and sessions.

Time (its logarithm) and ease: fixed effects of condition and session; crossed random effects of readers, of each reader
under each condition, and of images. The fit is by restricted maximum likelihood over *all* answers. Answers of un-aged
sessions show each image's difficulty, which is part of the noise in the paper's own tests. Each reader may react to a
condition in a different way, so the number of readers limits the precision, not the number of images. Therefore tests
and intervals use Student's t with Satterthwaite's degrees of freedom.

y = X·β + Σ Z_i·u_i + ε, where u_i and ε are normal with the variances λ_i·σ² and σ². The deviance, profiled over β and
σ², is minimised over λ_i ≥ 0 (Bates, Mächler, Bolker & Walker, J. Stat. Softw. 67 (2015), doi:10.18637/jss.v067.i01).
The inverse of the covariance needs matrices no larger than the number of levels (Woodbury). A variance of 0 is a valid
estimate. An estimate has a variance C, a known function of the variances θ. Its test uses Student's t with
2·C²/(gᵀ·I⁻¹·g) degrees of freedom, where g are the derivatives of C and I is the expected information on θ. Sources:
Satterthwaite, Biometrics Bull. 2, 110 (1946), doi:10.2307/3002019; for mixed models Giesbrecht & Burns, Biometrics 41,
477 (1985). lutgen fits these models itself, since the mixed model of statsmodels did not converge in 6 of 60 fits with
three variances, and takes two seconds to import.

Agreement: logistic regression on the condition with readers as fixed effects, by generalized estimating equations with
readings of the same image in a cluster (Liang & Zeger 1986, doi:10.1093/biomet/73.1.13), fitted by statsmodels
(``lutgen[study]``), since answers of several readers to one image are not independent.

The models leave out effects that the answers cannot separate, and a note names them. With one reader there is no
effect of readers. The effect of an image that was read once cannot be separated from the noise of its answer.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from math import exp, inf, log
from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.numerals import in_percent
from lutgen.study.answers import Answer
from lutgen.study.statistics import UNAGED, Interval, ReadingPair

#: The remark if statsmodels is not installed.
MISSING = "Mixed models are left out: statsmodels is not installed. Install lutgen[study]."

#: The grouping of readers under each condition.
BY_CONDITION = "readers_by_condition"

#: Measure → unit of an effect.
EFFECTS = {"time": "ratio of times", "ease": "difference", "agreement": "odds ratio"}


@dataclass(frozen=True)
class ConditionEffect:
    """The effect of a condition against the first condition, in the unit that the model's ``effect`` names."""

    condition: str
    estimate: float
    ci95: Interval
    p: float


@dataclass(frozen=True)
class MixedModel:
    """A fitted mixed model, or the reason why the model was not fitted."""

    #: A key of ``EFFECTS`` and its value.
    measure: str
    effect: str
    #: The condition with which other conditions are compared.
    against: str
    #: Number of answers, or of pairs of readings.
    n: int
    #: Effects of the other conditions; none if the model could not be fitted.
    effects: tuple[ConditionEffect, ...]
    #: Standard deviations, in log seconds or ease, of the groupings in the model and of the noise, ``rest``.
    sd: Mapping[str, float] = field(default_factory=dict)
    #: Notes on effects that were left out, and on problems of the fit.
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class MixedFit:
    """The estimates of a mixed model."""

    #: Fixed effects, their standard errors and their degrees of freedom, (k,) each.
    coefficients: Array
    errors: Array
    freedom: Array
    #: Variance of each grouping, and of the noise as ``rest``.
    variances: dict[str, float]
    #: The faults of the fit, in clauses.
    complaints: tuple[str, ...] = ()


def available() -> bool:
    """Return whether statsmodels is installed."""
    return find_spec("statsmodels") is not None


def mixed_models(
    conditions: Sequence[str], answers: Sequence[Answer], reading_pairs: Sequence[ReadingPair]
) -> tuple[MixedModel, ...]:
    """Fit models of time, ease and agreement. The notes of a model that cannot be fitted state the reason."""
    return (
        _of_answers("time", conditions, answers, lambda answer: log(answer.seconds)),
        _of_answers("ease", conditions, answers, lambda answer: float(answer.ease)),
        _of_agreement(conditions, reading_pairs),
    )


def _of_answers(
    measure: str, conditions: Sequence[str], answers: Sequence[Answer], value: Callable[[Answer], float]
) -> MixedModel:
    values = np.array([value(answer) for answer in answers])
    shown = [condition for condition in conditions if any(answer.condition == condition for answer in answers)]
    columns = _indicators([answer.condition for answer in answers], shown)
    columns += _indicators([answer.session for answer in answers], sorted({answer.session for answer in answers}))
    fixed = np.column_stack([np.ones(len(answers)), *columns])
    groups, notes = _groupings(answers)
    blank = MixedModel(measure, EFFECTS[measure], shown[0], len(answers), ())
    if len(shown) < 2:
        return _not_fitted(blank, "there is only one condition")
    if np.linalg.matrix_rank(fixed) < fixed.shape[1]:
        return _not_fitted(blank, "the effects of conditions and of sessions cannot be separated")
    if np.ptp(values) == 0 or len(values) <= fixed.shape[1] + len(groups):
        return _not_fitted(blank, "too few answers, or all answers are equal")
    try:
        fit = fit_crossed(values, fixed, groups)
    except (np.linalg.LinAlgError, ValueError) as error:
        return _not_fitted(blank, f"the fit failed ({error})")
    change = _ratio if measure == "time" else float
    share = float(np.mean(values == values.max()))
    # With at least this share of answers at the highest ease, errors cannot be normal.
    if measure == "ease" and share >= 0.25:
        at_the_end = f"{in_percent(share)} of the answers are {values.max():g}, the highest given"
        notes.append(f"{at_the_end}: the errors are not normal, so rely less on this model")
    sd = {name: variance**0.5 for name, variance in fit.variances.items()}
    # Readers usually react alike: then their variance in the table is 0, which needs no note.
    alike = [
        f"no differences between {name} found: their variance is on its boundary, 0"
        for name in groups
        if name != BY_CONDITION and fit.variances[name] < NOTHING * fit.variances["rest"]
    ]
    return replace(blank, effects=_effects(shown, fit, change), sd=sd, notes=(*notes, *alike, *fit.complaints))


def _indicators(labels: Sequence[object], levels: Sequence[object]) -> list[Array]:
    """Return a column of 0 and 1 for each level but the first."""
    return [np.array([label == level for label in labels], np.float64) for level in levels[1:]]


def _groupings(answers: Sequence[Answer]) -> tuple[dict[str, list[str]], list[str]]:
    """Return the labels of readers and images that the model can include, and notes on groupings that it cannot."""
    readers, images = [answer.reader for answer in answers], [answer.image for answer in answers]
    groups, notes = {}, []
    if len(set(readers)) > 1:
        groups["readers"] = readers
    else:
        notes.append("one reader: no differences between readers in the model")
    by_condition = [f"{answer.reader}\n{answer.condition}" for answer in answers]
    cells, conditions = len(set(by_condition)), len({answer.condition for answer in answers})
    # A grouping needs more cells than the fixed and reader effects explain, and more answers than cells.
    if len(set(readers)) > 1 and len(set(readers)) + conditions - 1 < cells < len(answers):
        groups[BY_CONDITION] = by_condition
    if len(set(images)) < len(images) and len(set(images)) > 1:
        groups["images"] = images
    else:
        notes.append("each image was read once: no differences between images in the model")
    return groups, notes


def _of_agreement(conditions: Sequence[str], reading_pairs: Sequence[ReadingPair]) -> MixedModel:
    shown = [condition for condition in conditions if any(pair.answer.condition == condition for pair in reading_pairs)]
    blank = MixedModel("agreement", EFFECTS["agreement"], shown[0] if shown else UNAGED, len(reading_pairs), ())
    if len(shown) < 2:
        return _not_fitted(blank, "fewer than two conditions have pairs of readings")
    agreed = np.array([pair.agreed for pair in reading_pairs], np.float64)
    under = np.array([pair.answer.condition for pair in reading_pairs])
    for condition in shown:
        if np.ptp(agreed[under == condition]) == 0:
            return _not_fitted(blank, f"under {condition} all readings agreed, or none: its odds have no estimate")
    readers = [pair.answer.reader for pair in reading_pairs]
    levels = sorted(set(readers))
    columns = [*_indicators(list(under), shown), *_indicators(readers, levels)]
    fixed = np.column_stack([np.ones(len(reading_pairs)), *columns])
    if np.linalg.matrix_rank(fixed) < fixed.shape[1]:
        return _not_fitted(blank, "the effects of conditions and of readers cannot be separated")
    images = np.unique(np.array([pair.answer.image for pair in reading_pairs]), return_inverse=True)[1]
    try:
        fit = _fit_logistic(agreed, fixed, images)
    except (np.linalg.LinAlgError, ValueError) as error:
        return _not_fitted(blank, f"the fit failed ({error})")
    several = len(levels) > 1
    notes = ["readers are fixed effects: valid only for them" if several else "one reader: not valid for other readers"]
    return replace(blank, effects=_effects(shown, fit, _ratio), notes=(*notes, *fit.complaints))


def _fit_logistic(agreed: Array, fixed: Array, clusters: Any) -> MixedFit:
    from statsmodels.genmod.cov_struct import Exchangeable, Independence
    from statsmodels.genmod.families import Binomial
    from statsmodels.genmod.generalized_estimating_equations import GEE

    structure = Exchangeable() if len(set(clusters)) < len(clusters) else Independence()
    model = GEE(agreed, fixed, groups=clusters, family=Binomial(), cov_struct=structure)
    result, errors, complaints = _fitted(model.fit)
    return MixedFit(np.asarray(result.params), errors, np.full(len(errors), inf), {}, complaints)


def _fitted(fit: Callable[[], Any]) -> tuple[Any, Array, tuple[str, ...]]:
    """Return the result, its standard errors, and each warning once. Raises ValueError: an error is not finite."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = fit()
        standard = np.asarray(result.bse, np.float64)
    if not (np.isfinite(standard) & (standard > 0)).all():
        raise ValueError("standard errors cannot be computed")
    warned = dict.fromkeys(str(each.message).partition("\n")[0].rstrip(".") for each in caught)
    complaints = [f"statsmodels: {text}" for text in warned]
    if not result.converged:
        complaints.append("the fit did not converge: do not rely on it")
    return result, standard, tuple(complaints)


def _effects(shown: Sequence[str], fit: MixedFit, change: Callable[[float], float]) -> tuple[ConditionEffect, ...]:
    from scipy.stats import t

    effects = []
    for place, condition in enumerate(shown[1:], start=1):
        value, error = float(fit.coefficients[place]), float(fit.errors[place])
        student = t(fit.freedom[place])
        reach = float(student.ppf(0.975)) * error
        p = 2 * float(student.sf(abs(value / error)))
        effects.append(ConditionEffect(condition, change(value), (change(value - reach), change(value + reach)), p))
    return tuple(effects)


def _ratio(logarithm: float) -> float:
    """Return the exponential of a logarithm; infinity if it is too large for a float."""
    return exp(logarithm) if logarithm < 700 else inf


def _not_fitted(blank: MixedModel, why: str) -> MixedModel:
    return replace(blank, notes=(f"not fitted: {why}",))


#: A grouping whose variance is a smaller share of the noise's variance counts as without variance.
NOTHING = 1e-6


def fit_crossed(values: Array, fixed: Array, groups: Mapping[str, Sequence[str]]) -> MixedFit:
    """Fit values (n,) = fixed (n, k)·β + a random effect of each grouping + noise. Raises LinAlgError or ValueError."""
    from scipy.optimize import minimize

    # A column of 0 and 1 for each level of a grouping, (n, levels).
    members = [(np.array(each)[:, np.newaxis] == np.unique(each)).astype(np.float64) for each in groups.values()]
    profiled = _profile(values, fixed, members)
    ratios, complaints = np.zeros(0), []
    if members:
        bounds = [(0.0, None)] * len(members)
        # Start values: ratios of a grouping's variance to the noise's variance.
        fits = [
            minimize(lambda each: profiled(each)[0], np.full(len(members), start), jac="3-point", bounds=bounds,
                     options={"ftol": 1e-14, "gtol": 1e-8, "maxiter": 1000})
            for start in (1.0, 0.05)
        ]  # fmt: skip
        best = min(fits, key=lambda each: float(each.fun))
        if not np.isfinite(best.fun):
            raise ValueError("the likelihood is not finite")
        ratios = np.asarray(best.x)
        if abs(fits[0].fun - fits[1].fun) > 1e-3:
            complaints.append("the fit did not converge: do not rely on it")
    _, rest, coefficients = profiled(ratios)
    variances = [float(ratio) * rest for ratio in ratios]
    errors, freedom = errors_and_freedom(fixed, members, variances, rest)
    if not (np.isfinite(errors) & (errors > 0)).all():
        raise ValueError("standard errors cannot be computed")
    named = dict(zip(groups, variances, strict=True)) | {"rest": rest}
    return MixedFit(coefficients, errors, freedom, named, tuple(complaints))


def _profile(values: Array, fixed: Array, members: Sequence[Array]) -> Callable[[Array], tuple[float, float, Array]]:
    """Return the function of the ratios λ_i that gives the deviance (up to a constant), σ² and β, (k,)."""
    free, number = len(values) - fixed.shape[1], fixed.shape[1]
    sizes = [member.shape[1] for member in members]
    both = np.column_stack([fixed, values])
    levels = np.column_stack([*members, np.zeros((len(values), 0))])
    products, overlaps, across = both.T @ both, levels.T @ levels, levels.T @ both

    def profiled(ratios: Array) -> tuple[float, float, Array]:
        # V = I + Σ λ_i·Z_i·Z_iᵀ; ``volume`` is log|V|, and ``inner`` is [X y]ᵀV⁻¹[X y].
        scale = np.sqrt(np.repeat(ratios, sizes))
        middle = np.linalg.cholesky(np.eye(len(scale)) + scale[:, np.newaxis] * overlaps * scale)
        volume = 2.0 * float(np.log(np.diag(middle)).sum())
        whitened = np.linalg.solve(middle, scale[:, np.newaxis] * across)
        inner = products - whitened.T @ whitened
        # The last diagonal entry of the factor of ``inner`` is the norm of y without the fixed effects.
        root = np.linalg.cholesky(inner)
        logs = np.log(np.diag(root))
        deviance = float(volume + 2.0 * logs[:-1].sum() + free * 2.0 * logs[-1])
        coefficients = np.linalg.solve(inner[:number, :number], inner[:number, number])
        return deviance, float(root[-1, -1] ** 2 / free), np.asarray(coefficients)

    return profiled


def errors_and_freedom(
    fixed: Array, members: Sequence[Array], variances: Sequence[float], rest: float
) -> tuple[Array, Array]:
    """Return standard errors, (k,), and degrees of freedom, at least 1, of the fixed effects."""
    total = rest * np.eye(len(fixed))
    for member, variance in zip(members, variances, strict=True):
        total += variance * member @ member.T
    inverse = np.linalg.inv(total)
    weighted = inverse @ fixed
    covariance = np.linalg.inv(fixed.T @ weighted)
    # Noise is a grouping with one value in each level.
    parts = [*members, np.eye(len(fixed))]
    left = inverse - weighted @ covariance @ weighted.T
    sides = [left @ part for part in parts]
    information = 0.5 * np.array([[((part.T @ side) ** 2).sum() for side in sides] for part in parts])
    slopes = np.array([((part.T @ weighted @ covariance) ** 2).sum(axis=0) for part in parts])
    spread = (slopes * np.linalg.solve(information, slopes)).sum(axis=0)
    own = np.diag(covariance)
    return np.sqrt(own), np.maximum(2.0 * own**2 / spread, 1.0)
