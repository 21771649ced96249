// The picture: the viewer with its controls (hours, modes, wiper, map and zoom), and the numbers beside it.

import { latest, trying } from "./server.js";
import { hourly, MAP_COLOURS, Viewer } from "./viewer.js";
import { byId, element, input, spaced, tell } from "./words.js";

/** Possible ends of the map's scale in ΔE2000. */
const REACHES = [2, 3, 5, 8, 12, 15, 20, 25, 30, 40, 50, 100];

/** Milliseconds without a move after which the slider counts as resting. */
const REST = 80;

/** Milliseconds of the transition to another model's picture, so that a user sees the change. */
const FADE = 700;

/** Return a viewer; null if the browser cannot draw, with the reason on the page. @param {HTMLElement} host */
function viewerIn(host) {
  try {
    return Object.assign(host, { viewer: new Viewer(host, ["un-aged", "aged", "compensated"]) }).viewer;
  } catch (error) {
    tell("image-trouble", error instanceof Error ? error.message : String(error));
    return null;
  }
}

/** @param {import("./server.js").Server} server */
export function pictureOf(server) {
  const slider = input("hours");
  const viewer = viewerIn(byId("viewer"));
  let reach = 0;
  let mode = "";
  /** Points along an edge of the tables. */
  let size = 0;

  const hours = () => Number(slider.value);
  const without = () => (input("with").checked ? "" : "yes");
  const asked = (more = {}) => ({
    mode,
    hours: hours(),
    size,
    map: input("map").checked ? "yes" : "",
    without: without(),
    ...more,
  });

  /** @param {"aged" | "compensated"} kind @param {(table: import("./viewer.js").Table, other: boolean) => void} hand told whether the model is another */
  const fetching = (kind, hand) =>
    latest(async (/** @type {boolean} */ other) => {
      await trying("image-trouble", async () => hand(await server.table(asked({ kind })), other));
    });
  const aged = fetching("aged", (table, other) => (other ? fade(table) : age(table)));
  const compensated = fetching("compensated", (table) => viewer?.correct(table));

  let fading = 0;
  const age = (/** @type {import("./viewer.js").Table} */ table) => {
    cancelAnimationFrame(fading);
    viewer?.age(table);
  };

  /** Blend to a table of another model. @param {import("./viewer.js").Table} table */
  const fade = (table) => {
    const before = viewer?.aged.first;
    const same = before?.size === table.size && before.values.every((each, place) => each === table.values[place]);
    if (!before || same || matchMedia("(prefers-reduced-motion: reduce)").matches) return age(table);
    cancelAnimationFrame(fading);
    const start = performance.now();
    const step = (/** @type {number} */ now) => {
      const share = (now - start) / FADE;
      if (share >= 1) return age(table);
      viewer?.age(before, table, Math.max(share, 0));
      fading = requestAnimationFrame(step);
    };
    step(start);
  };

  /** The numbers of the previous model at the same mode and hours. @type {{at: string, now: Record<string, string>, was: Record<string, string>}} */
  let last = { at: "", now: {}, was: {} };

  const figures = latest(async () => {
    const at = `${mode} ${hours()} ${byId("image-note").textContent}`;
    /** @type {import("./contract").Figures} */
    const found = await server.get("difference", { mode, hours: hours(), without: without() }).catch(() => ({}));
    /** @type {Record<string, string>} */
    const now = {};
    for (const name of /** @type {const} */ (["mean", "mean_2sd"])) {
      now[name] = found[name] == null ? "…" : found[name].toFixed(2);
    }
    if (at !== last.at || Object.values(last.now).includes("…")) last = { at, now, was: {} };
    else if (now.mean !== last.now.mean) last = { at, now, was: last.now };
    for (const [name, value] of Object.entries(now)) {
      const was = last.was[name] ? element("small", {}, ` was ${last.was[name]}`) : "";
      byId(`figure-${name}`).replaceChildren(value, was);
    }
    for (const name of /** @type {const} */ (["hours_to_3", "hours_to_5"])) {
      const last = Number(slider.max);
      const beyond = last ? `> ${spaced(last)} h` : "–";
      byId(`figure-${name}`).textContent =
        found.mean == null ? "…" : found[name] == null ? beyond : `${spaced(found[name])} h`;
    }
    if (found.mean_2sd != null) widen(found.mean_2sd);
  });

  /** Extend the map's scale to a ΔE2000. The scale never shrinks, so that pictures can be compared. @param {number} difference */
  const widen = (difference) => {
    const wanted = REACHES.find((each) => each >= difference) ?? 100;
    if (wanted <= reach) return;
    reach = wanted;
    const step = [0.5, 1, 2, 2.5, 5, 10, 20, 25].find((each) => reach / each <= 5) ?? reach;
    const marks = Array.from({ length: Math.ceil(reach / step) }, (_, number) => number * step).concat(reach);
    byId("scale-bar").replaceChildren(
      ...marks.map((value) => {
        const mark = element("span", {}, value === reach ? `≥ ${value}` : String(value));
        mark.style.left = `${(100 * value) / reach}%`;
        return mark;
      }),
    );
    if (input("map").checked) viewer?.map(reach);
  };

  /** Computing a correction takes as long as many tables, so it starts when the slider rests. */
  let resting = 0;
  const correct = () => {
    clearTimeout(resting);
    if (viewer && viewer.cuts[1] < 1) resting = setTimeout(() => void compensated(false), REST);
  };
  const draw = (other = false) => {
    if (viewer) void aged(other);
    correct();
  };

  const said = () => {
    const text = `${spaced(hours())} h`;
    byId("hours-now").textContent = text;
    slider.setAttribute("aria-valuetext", text);
  };
  const show = (other = false) => {
    said();
    draw(other);
    void figures(null);
  };

  hourly(slider, () => show());
  byId("modes").addEventListener("change", (event) => {
    mode = /** @type {HTMLInputElement} */ (event.target).value;
    show();
  });
  input("with").addEventListener("change", () => show(true));
  byId("scale-bar").style.backgroundImage = `linear-gradient(to right, ${MAP_COLOURS.join(", ")})`;
  input("map").addEventListener("change", () => {
    byId("scale").hidden = !input("map").checked;
    if (!reach) widen(5);
    viewer?.map(input("map").checked ? reach : 0);
    show();
  });
  byId("frame").hidden = !viewer;
  if (viewer) {
    const zooms = {
      fit: () => 0,
      pixels: () => 1,
      nearer: () => viewer.scale * 1.5,
      farther: () => viewer.scale / 1.5,
    };
    for (const [id, zoom] of Object.entries(zooms)) byId(id).addEventListener("click", () => viewer.zoomTo(zoom()));
    viewer.zoomed = () => {
      byId("zoom").textContent = `${Math.round(100 * viewer.scale)} %`;
    };
    byId("viewer").addEventListener("pointerup", () => draw());
  }

  /** Show a note if a large image is shown reduced. @param {import("./contract").ImageSize | null} image */
  const note = (image) => {
    const smaller = image && image.shown_width < image.width;
    byId("image-note").textContent = smaller
      ? `${spaced(image.width)} × ${spaced(image.height)} pixels. ${image.note}`
      : "";
  };

  const load = async () => {
    const response = await server.fetch(server.address("image"));
    const options = /** @type {ImageBitmapOptions} */ ({ colorSpaceConversion: "none", premultiplyAlpha: "none" });
    const image = await createImageBitmap(await response.blob(), options);
    viewer?.show(image);
    viewer?.zoomed();
  };

  return {
    /** The shown mode and hours, as a request's query. */
    shown: () => ({ mode, hours: hours() }),
    note,
    /** The image's colours have been counted: request its numbers. */
    measure: () => void figures(null),
    /** The model has changed: draw the same picture again. @param {import("./contract").ModelError} error */
    refresh({ provisional, effects }) {
      if (!provisional) {
        const names = effects.filter((each) => !each.given).map((each) => each.name);
        tell("with-names", names.length ? `with ${names.join(", ")}` : "");
        byId("with-label").hidden = !names.length;
        input("with").checked = true;
      }
      show(true);
    },
    /** Begin with a session. @param {import("./contract").Overview} overview */
    async begin(overview) {
      const modes = byId("modes");
      mode ||= overview.first.mode;
      size = overview.first.size;
      modes.replaceChildren(
        modes.firstElementChild ?? "",
        ...overview.modes.map((each) => {
          const radio = element("input", { type: "radio", name: "mode", value: each });
          radio.checked = each === mode;
          return element("label", {}, radio, ` ${each}`);
        }),
      );
      // For another model of the same display the hour stays.
      if (slider.max !== String(overview.max_hours)) {
        slider.max = String(overview.max_hours);
        slider.value = slider.max;
      }
      reach = 0;
      const last = overview.max_hours || 1;
      // Labels of hours that would overlap are left out, except the first and the last.
      let right = Number.NEGATIVE_INFINITY;
      const kept = overview.hours.filter((hour) => {
        const fits = hour === last || (hour / last - right > 0.09 && (hour === 0 || 1 - hour / last > 0.09));
        if (fits) right = hour / last;
        return fits;
      });
      byId("hours-ticks").replaceChildren(
        ...kept.map((hour) => {
          const tick = element("span", {}, spaced(hour));
          tick.style.left = `${(100 * hour) / last}%`;
          if (hour === last) tick.classList.add("last");
          return tick;
        }),
      );
      byId("one-hour").hidden = overview.max_hours > 0;
      slider.disabled = !overview.max_hours;
      note(overview.image);
      said();
      // First the picture; its corrected part and its numbers are requested after it.
      if (viewer) {
        await Promise.all([aged(false), load()]);
        viewer.draw();
        document.body.dataset.picture = "drawn";
      }
      correct();
      void figures(null);
    },
    /** Send another image and show it. @param {File} file */
    async take(file) {
      const before = byId("image-note").textContent;
      byId("image-note").textContent = "Reading the image …";
      const taken = await trying("image-trouble", async () => {
        server.check([file], "image");
        const size = await server.post("image", file, { name: file.name });
        await load();
        note(size);
        reach = 0;
        show();
      });
      if (!taken) byId("image-note").textContent = before;
    },
  };
}
