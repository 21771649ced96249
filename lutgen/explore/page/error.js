// The error: one number and its bar, its slices, its patches, and the drift of colours.

import { driftChart, multiple } from "./chart.js";
import { byId, element, ratio, spaced, spacedIn } from "./words.js";

/** @typedef {import("./contract").ModelError} ModelError */
/** @typedef {import("./contract").Reading} Reading */

/** Most swatches: more than any screen shows. */
const MOST = 200;

/** Most readings in a tip. */
const LISTED = 5;

/** Possible ends of the charts' axis. */
const TOPS = [10, 30, 100, 300, 1000, 3000, 10_000, 100_000];

/** @param {readonly number[]} colour */
const css = (colour) => `rgb(${colour.map((each) => Math.round(each)).join(" ")})`;

/** @param {readonly number[]} patch */
const code = (patch) => patch.map((each) => Number(each.toFixed(3))).join(", ");

/** Return a slice with formatted labels and points sorted by number, or by the number at the start of a name. @param {import("./contract").Slice} slice */
function ordered(slice) {
  const number = (/** @type {import("./contract").Point} */ { at }) =>
    typeof at === "number" ? at : Number.parseFloat(at);
  const points = slice.points.map((each) => ({ ...each, label: spacedIn(each.label) }));
  if (points.some((each) => Number.isNaN(number(each)))) return { ...slice, points };
  const length = (/** @type {import("./contract").Point} */ { label }) => label.length;
  return { ...slice, points: points.sort((a, b) => number(a) - number(b) || length(a) - length(b)) };
}

export function errorOf() {
  /** Undefined while the first comparison runs. @type {ModelError} */
  let error;
  /** The largest error of the open session: the end of the bar. */
  let first = 0;
  /** Whether the error of the open session is known. */
  let known = false;
  /** @type {{slice: string, at: number | string} | null} */
  let choice = null;
  /** @type {Map<number, Reading>} */
  let readings = new Map();
  let top = 10;

  const bar = () => {
    const { noise_ratio: now, provisional, what_if: whatIf } = error;
    const end = Math.max(first, 4);
    byId("ratio-number").textContent = `${ratio(now)} ×`;
    const share = (/** @type {number} */ value) => `${Math.min(100, (100 * value) / end)}%`;
    byId("ratio-bar").style.width = share(now);
    byId("ratio-first").style.left = share(first);
    byId("noise-line").style.left = share(1);
    byId("error").classList.toggle("good", error.agrees);
    byId("error").classList.toggle("provisional", Boolean(provisional || whatIf));
    byId("error-mean").textContent =
      `model's error: mean ΔE2000 ${error.mean_de2000.toFixed(2)}; noise alone ${error.noise_de2000.toFixed(2)}`;
    byId("error-state").textContent = whatIf
      ? "what if: not the fit"
      : provisional
        ? "provisional: one linear step, the fit is running …"
        : "";
    byId("error-where").textContent = spacedIn(error.sentence);
  };

  const chosenSlice = () => error.slices.find((each) => each.name === choice?.slice);

  const chosenPoint = () => chosenSlice()?.points.find((each) => each.at === choice?.at);

  const charts = () => {
    // The element with the focus is replaced: the new element gets the focus.
    const had = document.activeElement?.closest(".slice")?.getAttribute("data-slice");
    const place = had
      ? [...(document.activeElement?.parentElement?.children ?? [])].indexOf(
          /** @type {Element} */ (document.activeElement),
        )
      : -1;
    const chosen = choice && chosenPoint();
    const ends = error.slices.flatMap((slice) => slice.points.map((point) => point.ratio));
    // The axis does not shrink while effects are switched, so that a user sees the points fall.
    top = Math.max(top, TOPS.find((each) => each >= Math.max(...ends)) ?? 100_000);
    const boxes = error.slices.map((slice) =>
      multiple(slice, {
        top,
        other:
          chosen && slice.name !== choice?.slice
            ? slice.points.map((point) => chosen.within[slice.name][point.place])
            : null,
        chosen: slice.name === choice?.slice ? slice.points.findIndex((point) => point.at === choice?.at) : -1,
        point: (number, button) => tip(slice, slice.points[number], button),
        choose: (number) => {
          const { at } = slice.points[number];
          choice = choice?.slice === slice.name && choice.at === at ? null : { slice: slice.name, at };
          charts();
          patches();
        },
      }),
    );
    if (error.drift.some((each) => each.points.length > 1)) boxes.push(driftChart(error.drift));
    byId("slices").replaceChildren(...boxes);
    if (had && place >= 0) {
      const next = document.querySelectorAll(`[data-slice="${had}"] .point`)[place];
      if (next instanceof HTMLElement) next.focus({ preventScroll: true });
    }
  };

  const patches = () => {
    const slice = chosenSlice();
    const point = chosenPoint();
    const rows = point && new Set(point.rows);
    const shown = error.readings.filter((each) => !rows || rows.has(each.row)).sort((a, b) => b.de2000 - a.de2000);
    const title = byId("readings-title");
    title.replaceChildren("Patches, measured | predicted, largest ΔE2000 first");
    if (slice && point) {
      const all = element("button", { type: "button" }, "all readings");
      all.addEventListener("click", () => {
        choice = null;
        charts();
        patches();
      });
      title.replaceChildren(`${shown.length} readings at ${slice.label} ${point.label} `, all);
    }
    byId("patches").replaceChildren(
      ...shown.slice(0, MOST).map((each) => {
        const item = element("li", {}, swatch(each), element("span", {}, each.de2000.toFixed(1)));
        const words = inWords(each);
        item.setAttribute("aria-label", words);
        item.addEventListener("pointerenter", () => showTip(item, [words]));
        item.addEventListener("pointerleave", () => showTip(null));
        return item;
      }),
    );
  };

  /** @param {import("./contract").Slice} slice @param {import("./contract").Point} point @param {HTMLElement | null} button */
  const tip = (slice, point, button) => {
    if (!button) return showTip(null);
    const behind = point.rows.flatMap((row) => readings.get(row) ?? []).sort((a, b) => b.de2000 - a.de2000);
    const head = element(
      "b",
      {},
      `${slice.label} ${point.label}: ${ratio(point.ratio)} × the noise, ${point.rows.length} readings`,
    );
    const lines = behind.slice(0, LISTED).map((each) => element("div", {}, swatch(each), ` ${inWords(each)}`));
    if (behind.length > LISTED) lines.push(element("div", {}, "…"));
    showTip(button, [head, ...lines]);
  };

  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") showTip(null);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => error && charts());

  return {
    /** Show an error, and return it. @param {ModelError} next */
    show(next) {
      error = { ...next, slices: next.slices.map(ordered) };
      known = true;
      first = Math.max(first, error.noise_ratio);
      readings = new Map(error.readings.map((each) => [each.row, each]));
      bar();
      charts();
      patches();
      return error;
    },
    /** Another session has begun. */
    forget() {
      first = 0;
      known = false;
      top = 10;
      choice = null;
      byId("ratio-number").textContent = "…";
      byId("error-mean").textContent = "Comparing the model with the readings …";
      for (const id of ["error-where", "error-state", "readings-title", "slices", "patches"])
        byId(id).replaceChildren();
      byId("ratio-bar").style.width = "0";
      byId("error").classList.remove("good", "provisional");
    },
    /** The shown error; undefined before the first comparison. */
    get now() {
      return known ? error : undefined;
    },
  };
}

/** @param {Reading} reading */
function swatch(reading) {
  const box = element("i", { class: "swatch" });
  box.style.backgroundImage = `linear-gradient(to right, ${css(reading.measured)} 50%, ${css(reading.predicted)} 50%)`;
  return box;
}

/** @param {Reading} reading */
const inWords = (reading) =>
  `line ${reading.line}: RGB ${code(reading.patch)} at ${spaced(reading.hours)} h, ΔE2000 ${reading.de2000.toFixed(2)}, ${ratio(reading.sigma)} σ`;

/** Show a tip beside an element; null hides the tip. @param {HTMLElement | null} beside @param {(Node | string)[]} content */
function showTip(beside, content = []) {
  const tip = byId("tip");
  tip.hidden = !beside;
  if (!beside) return;
  tip.replaceChildren(...content);
  const { left, bottom, top } = beside.getBoundingClientRect();
  const { offsetWidth: width, offsetHeight: height } = tip;
  tip.style.left = `${Math.max(4, Math.min(left, innerWidth - width - 4))}px`;
  tip.style.top = `${bottom + height + 6 < innerHeight ? bottom + 4 : Math.max(top - height - 4, 4)}px`;
}
