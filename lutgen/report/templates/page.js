import { hourly, Viewer } from "./viewer.js";

/** @param {string} id */
const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** @param {string} id */
const field = (id) => /** @type {HTMLInputElement} */ (byId(id));

/** @typedef {{hours: number, mean: number, sd: number, p95: number, max: number, white_x: number, white_y: number, luminance: number}} Numbers */
/** @typedef {{size: number, values: Uint16Array<ArrayBuffer>}} Table */

/** @type {{hours: number[], modes: Record<string, Numbers[]>, table_size: number, tables: Record<string, string[]>, map_reach: number}} */
const data = JSON.parse(byId("data").textContent ?? "");

/** Unpack a table from its text: differences along red, first all high bytes, then all low bytes. @param {string} text */
async function unpacked(text) {
  const size = data.table_size;
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const inflated = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(inflated).arrayBuffer());
  const values = new Uint16Array(4 * size ** 3);
  for (let place = 0; place < values.length; place += 1) {
    const before = Math.floor(place / 4) % size ? values[place - 4] : 0;
    values[place] = before + (bytes[place] << 8) + bytes[values.length + place];
  }
  return { size, values };
}

/** Write hours with spaces between thousands, as everywhere in lutgen. @param {number} hours */
const spaced = (hours) => String(Math.round(hours)).replace(/\B(?=(\d{3})+$)/g, "\u00a0");

/** @param {Numbers} first @param {Numbers} second @param {number} share */
const between = (first, second, share) => {
  const mixed = /** @type {(name: keyof Numbers) => number} */ (
    (name) => first[name] + share * (second[name] - first[name])
  );
  return {
    mean: mixed("mean").toFixed(2),
    sd: mixed("sd").toFixed(2),
    p95: mixed("p95").toFixed(2),
    max: mixed("max").toFixed(2),
    white: `${mixed("white_x").toFixed(4)}, ${mixed("white_y").toFixed(4)}`,
    luminance: `${(100 * mixed("luminance")).toFixed(1)} %`,
  };
};

async function begin() {
  /** @type {Record<string, Table[]>} */
  const tables = {};
  for (const [mode, texts] of Object.entries(data.tables)) tables[mode] = await Promise.all(texts.map(unpacked));
  const viewer = new Viewer(byId("picture"), ["un-aged", "aged"]);
  const image = /** @type {HTMLImageElement} */ (byId("source"));
  await image.decode();
  viewer.show(await createImageBitmap(image, { colorSpaceConversion: "none", premultiplyAlpha: "none" }));

  const slider = field("hours");
  const marker = byId("marker");
  const scene = () => {
    const mode = /** @type {HTMLInputElement} */ (document.querySelector("input[name=mode]:checked")).value;
    const hours = Number(slider.value);
    const last = data.hours.length - 1;
    const after = Math.min(
      Math.max(
        data.hours.findIndex((each) => each >= hours),
        1,
      ),
      last,
    );
    const before = Math.max(after - 1, 0);
    const share = after === before ? 0 : (hours - data.hours[before]) / (data.hours[after] - data.hours[before]);
    viewer.age(tables[mode][before], tables[mode][after], share);
    const name = `${spaced(hours)}\u00a0h`;
    byId("hours-now").textContent = name;
    slider.setAttribute("aria-valuetext", name);
    const near = share > 0 && share < 1 ? "≈\u202f" : "";
    for (const [key, text] of Object.entries(between(data.modes[mode][before], data.modes[mode][after], share))) {
      byId(`number-${key}`).textContent = near + text;
    }
    const { left, across, last: end } = marker.dataset;
    marker.setAttribute(
      "transform",
      `translate(${(Number(left) + (Number(across) * hours) / Number(end)).toFixed(2)} 0)`,
    );
  };
  hourly(slider, scene);
  for (const radio of document.querySelectorAll("input[name=mode]")) radio.addEventListener("change", scene);
  field("map").addEventListener("change", () => {
    viewer.map(field("map").checked ? data.map_reach : 0);
    byId("bar").hidden = !field("map").checked;
  });
  byId("fit").addEventListener("click", () => viewer.zoomTo(0));
  byId("pixels").addEventListener("click", () => viewer.zoomTo(1));
  scene();
  // For tests, and for use in the browser's console.
  Object.assign(window, { viewer });
}

begin().catch((trouble) => {
  // The pictures of the last hour need no script.
  document.documentElement.className = "no-script";
  byId("trouble").textContent = trouble instanceof Error ? trouble.message : String(trouble);
  byId("trouble").hidden = false;
});
