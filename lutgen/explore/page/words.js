// Numbers in the format of lutgen, and helpers for the page's elements.

/** @param {number} value */
export const spaced = (value) => String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, "\u00a0");

/** Format whole numbers before a unit in a text, and keep number and unit in one line. @param {string} text */
export const spacedIn = (text) =>
  text
    .replace(/(?<![\d.])\d{4,}(?= \p{L})/gu, (digits) => spaced(Number(digits)))
    .replace(/(?<=\d) (?=\d{3}(?!\d))/g, "\u00a0");

/** Format an error / noise: 39.6, 1.0, 125. @param {number} value */
export const ratio = (value) => (value >= 100 ? value.toFixed(0) : value.toFixed(1));

/** Format a value with a number of significant digits, with powers of ten if it is very small or large. @param {number} value */
export function readable(value, figures = 4) {
  if (value === 0 || !Number.isFinite(value)) return String(value);
  const power = Math.floor(Math.log10(Math.abs(value)));
  if (power >= -4 && power < 5) return String(Number(value.toPrecision(figures)));
  const shift = 3 * Math.floor(power / 3);
  const digits = [...String(shift)].map((each) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(each)] ?? "⁻").join("");
  return `${Number((value / 10 ** shift).toPrecision(figures))} ×10${digits}`;
}

/** The page's element with an identifier. @param {string} id */
export const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** The page's input with an identifier. @param {string} id */
export const input = (id) => /** @type {HTMLInputElement} */ (document.getElementById(id));

/**
 * Create an element.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag @param {Record<string, string>} [attributes] @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** The style sheet's present value of a colour (light or dark mode), for canvases. @param {string} name */
export function colour(name) {
  document.body.style.setProperty("outline-color", `var(${name})`);
  return getComputedStyle(document.body).outlineColor;
}

/** Show a sentence in an element; hide the element if the sentence is empty. @param {string} id @param {string} sentence */
export function tell(id, sentence = "") {
  const place = byId(id);
  place.textContent = sentence;
  place.hidden = !sentence;
}

/** Offer bytes to download as a file. @param {Blob} blob @param {string} name */
export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
