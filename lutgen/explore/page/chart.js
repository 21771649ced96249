// Charts by uPlot (vendor/NOTICE gives the reason): the error in slices of the readings, and the drift of colours.

import uPlot from "./vendor/uPlot.esm.js";
import { colour, element, ratio, spaced } from "./words.js";

/** An error of up to this many times the noise may be noise, as in `lutgen compare`. */
const CLEAR = 1.5;

const FONT = "10px system-ui, sans-serif";

/** Places along the axis: the points' numbers if they have numbers, else their indices. @param {import("./contract").Point[]} points */
function places(points) {
  const numbers = points.map((point) => point.at);
  const own = numbers.every((each) => typeof each === "number") && new Set(numbers).size === numbers.length;
  return own ? /** @type {number[]} */ (numbers) : numbers.map((_, place) => place);
}

/** Ticks of the axis: powers of ten and the noise. */
const LEVELS = [1, 10, 100, 1000, 10_000];

/**
 * One small multiple: error / noise, the noise as a band, and a button on each point.
 * @param {import("./contract").Slice} slice
 * @param {{top: number, other: (number | null)[] | null, chosen: number, point: (place: number, button: HTMLElement | null) => void, choose: (place: number) => void}} options
 */
export function multiple(slice, { top, other, chosen, point, choose }) {
  const host = element("div", { class: "plot" });
  const box = element(
    "figure",
    { class: "slice", "data-slice": slice.name },
    element("figcaption", {}, slice.label),
    host,
  );
  const across = places(slice.points);
  const [first, last] = [Math.min(...across), Math.max(...across)];
  const room = (last - first || 1) * 0.06;
  /** @type {uPlot.AlignedData} */
  const data = [across, slice.points.map((each) => each.ratio), other ?? across.map(() => null)];
  const buttons = slice.points.map((each, place) => {
    const button = element("button", { type: "button", class: "point", tabindex: place ? "-1" : "0" });
    button.setAttribute(
      "aria-label",
      `${slice.label} ${each.label}: ${ratio(each.ratio)} times the noise, ${each.rows.length} readings`,
    );
    button.setAttribute("aria-pressed", String(place === chosen));
    button.classList.toggle("clear", each.ratio > CLEAR);
    for (const name of ["focus", "pointerenter"]) button.addEventListener(name, () => point(place, button));
    for (const name of ["blur", "pointerleave"]) button.addEventListener(name, () => point(place, null));
    button.addEventListener("click", () => choose(place));
    button.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
      const next = step && buttons[place + step];
      if (!next) return;
      event.preventDefault();
      buttons.forEach((one) => {
        one.tabIndex = one === next ? 0 : -1;
      });
      next.focus();
    });
    return button;
  });
  // Names have no order, so no line joins their points.
  const named = slice.points.some((each) => Number.isNaN(Number.parseFloat(String(each.at))));
  const quiet = colour("--quiet");
  const accent = colour(slice.points.some((each) => each.ratio > CLEAR) ? "--error" : "--good");
  const ends = [slice.points[0], slice.points[slice.points.length - 1]].map((each) => each.label);
  /** @type {Partial<uPlot.Options>} */
  const options = {
    scales: { x: { time: false, range: [first - room, last + room] }, y: { distr: 3, range: [0.6, top] } },
    axes: [
      { ...axis(), size: 16, grid: { show: false }, splits: () => [], values: () => [] },
      {
        ...axis(),
        size: 26,
        gap: 3,
        splits: () => LEVELS.filter((each) => each <= top),
        values: (_, splits) => splits.map(spaced),
        filter: (_, splits) => splits,
      },
    ],
    series: [
      {},
      { stroke: other ? quiet : accent, width: named ? 0 : 1.5, points: { show: false }, alpha: other ? 0.45 : 1 },
      { stroke: accent, width: named ? 0 : 2, points: { show: true, size: 6, fill: accent }, spanGaps: true },
    ],
    hooks: {
      drawClear: [(plot) => band(plot), (plot) => named && stems(plot, data, other ? quiet : accent)],
      draw: [(plot) => ticks(plot, ends, quiet)],
    },
  };
  /** @param {uPlot} plot */
  const put = (plot) =>
    buttons.forEach((button, place) => {
      button.style.left = `${plot.valToPos(across[place], "x")}px`;
      button.style.top = `${plot.valToPos(Math.min(slice.points[place].ratio, top), "y")}px`;
    });
  const layer = element(
    "div",
    { class: "points", role: "group", "aria-label": `${slice.label}: error over noise` },
    ...buttons,
  );
  drawIn(host, options, data, (plot) => {
    const { left, top: above } = plot.over.getBoundingClientRect();
    const from = host.getBoundingClientRect();
    layer.style.left = `${left - from.left}px`;
    layer.style.top = `${above - from.top}px`;
    put(plot);
  });
  host.append(layer);
  return box;
}

/** The common options of an axis. @returns {uPlot.Axis} */
const axis = () => ({
  gap: 2,
  font: FONT,
  stroke: colour("--quiet"),
  grid: { stroke: colour("--line"), width: 1 },
  ticks: { show: false },
});

/**
 * Draw a chart in an element, and redraw it when the element's size changes.
 * @param {HTMLElement} host @param {Partial<uPlot.Options>} options @param {uPlot.AlignedData} data @param {(plot: uPlot) => void} [fitted]
 */
function drawIn(host, options, data, fitted = () => {}) {
  const plain = { width: 100, height: 60, padding: [6, 8, 0, 0], legend: { show: false }, cursor: { show: false } };
  const plot = new uPlot(/** @type {uPlot.Options} */ ({ ...plain, ...options }), data, host);
  plot.root.setAttribute("aria-hidden", "true");
  new ResizeObserver(() => {
    if (!host.clientWidth) return;
    plot.setSize({ width: host.clientWidth, height: host.clientHeight });
    fitted(plot);
  }).observe(host);
}

/** Draw the noise: a band up to the clear error, and a line at 1. @param {uPlot} plot */
function band(plot) {
  const { ctx, bbox } = plot;
  const [above, line] = [CLEAR, 1].map((level) => plot.valToPos(level, "y", true));
  ctx.save();
  ctx.fillStyle = colour("--noise");
  ctx.fillRect(bbox.left, above, bbox.width, bbox.top + bbox.height - above);
  ctx.strokeStyle = colour("--fine");
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  ctx.moveTo(bbox.left, line);
  ctx.lineTo(bbox.left + bbox.width, line);
  ctx.stroke();
  ctx.restore();
}

/** Draw a stem from the noise to each point. @param {uPlot} plot @param {uPlot.AlignedData} data @param {string} stroke */
function stems(plot, [across, ratios], stroke) {
  const { ctx } = plot;
  ctx.save();
  ctx.strokeStyle = stroke;
  ctx.lineWidth = 1.5 * devicePixelRatio;
  ctx.beginPath();
  across.forEach((place, number) => {
    const left = plot.valToPos(place, "x", true);
    ctx.moveTo(left, plot.valToPos(1, "y", true));
    ctx.lineTo(left, plot.valToPos(/** @type {number} */ (ratios[number]), "y", true));
  });
  ctx.stroke();
  ctx.restore();
}

/** Label the first and the last place. @param {uPlot} plot @param {string[]} ends @param {string} stroke */
function ticks(plot, ends, stroke) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.fillStyle = stroke;
  ctx.font = FONT.replace("10px", `${10 * devicePixelRatio}px`);
  ctx.textBaseline = "top";
  const below = bbox.top + bbox.height + 3 * devicePixelRatio;
  const [first, last] = ends;
  ctx.textAlign = "left";
  if (ctx.measureText(first + last).width < bbox.width - 8) ctx.fillText(first, bbox.left, below);
  ctx.textAlign = "right";
  if (last !== first) ctx.fillText(last, bbox.left + bbox.width, below, bbox.width);
  ctx.restore();
}

/** Marks of the colours in the chart of drift. */
const MARKS = /** @type {Record<string, string>} */ ({
  white: "--ink",
  red: "--red",
  green: "--green",
  blue: "--blue",
});

/**
 * Draw Δu′v′ of white and primaries since the first session: points are measured, lines are predicted.
 * @param {import("./contract").Drift[]} drift
 */
export function driftChart(drift) {
  const host = element("div", { class: "plot", role: "img" });
  const traces = drift
    .filter((each) => each.points.length > 1)
    .map(({ name, points }) => {
      const [, u, v] = points[0];
      return {
        name,
        stroke: colour(MARKS[name] ?? "--quiet"),
        measured: points.map((each) => [each[1] - u, each[2] - v]),
        predicted: points.map((each) => [each[3] - u, each[4] - v]),
        hours: points[points.length - 1][0],
      };
    });
  const names = traces
    .map(({ name, measured }) => `${name} ${Math.hypot(...(measured.at(-1) ?? [0, 0])).toFixed(4)}`)
    .join(", ");
  host.setAttribute(
    "aria-label",
    `Drift of white and primaries in u′v′ since the first session: ${names}. Points are measured, lines predicted.`,
  );
  const all = traces.flatMap(({ measured, predicted }) => [...measured, ...predicted]);
  const reach = (/** @type {0 | 1} */ axis) => {
    const values = all.map((each) => each[axis]).concat(0);
    const room = Math.max(Math.max(...values) - Math.min(...values), 0.002) * 0.12;
    return /** @type {[number, number]} */ ([Math.min(...values) - room, Math.max(...values) + room]);
  };
  const values = (/** @type {uPlot} */ _, /** @type {number[]} */ splits) =>
    splits.map((each) => String(Number(each.toFixed(4))));
  const nothing = /** @type {uPlot.AlignedData} */ ([
    [0, 1],
    [0, 0],
  ]);
  /** @type {Partial<uPlot.Options>} */
  const options = {
    padding: [6, 18, 0, 0],
    scales: { x: { time: false, range: reach(0) }, y: { range: reach(1) } },
    axes: [
      { ...axis(), values, size: 16, space: 45 },
      { ...axis(), values, size: 46, space: 18 },
    ],
    series: [{}, { show: false }],
    hooks: { draw: [(plot) => traces.forEach((trace) => void draw(plot, trace))] },
  };
  drawIn(host, options, nothing);
  const legend = traces.map(({ name, stroke }) => {
    const word = element("b", {}, name);
    word.style.setProperty("--mark", stroke);
    return word;
  });
  return element(
    "figure",
    { class: "slice drift", "data-slice": "drift", title: "Since the first session: points measured, lines predicted" },
    element("figcaption", {}, "Δu′v′ ", ...legend),
    host,
  );
}

/** @param {uPlot} plot @param {{stroke: string, measured: number[][], predicted: number[][]}} trace */
function draw(plot, { stroke, measured, predicted }) {
  const { ctx } = plot;
  const at = (/** @type {number[]} */ [u, v]) =>
    /** @type {[number, number]} */ ([plot.valToPos(u, "x", true), plot.valToPos(v, "y", true)]);
  ctx.save();
  ctx.strokeStyle = ctx.fillStyle = stroke;
  ctx.lineWidth = 1.5 * devicePixelRatio;
  ctx.beginPath();
  for (const each of predicted) ctx.lineTo(...at(each));
  ctx.stroke();
  for (const each of measured) {
    ctx.beginPath();
    ctx.arc(...at(each), 2.5 * devicePixelRatio, 0, 7);
    ctx.fill();
  }
  ctx.restore();
}
