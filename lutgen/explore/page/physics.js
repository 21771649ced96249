// The physics: the effects with a switch each, their parameters, the diagnosis, and the user's own effects.

import { latest, trying } from "./server.js";
import { byId, element, input, ratio, readable, save, spacedIn, tell } from "./words.js";

/** @typedef {import("./contract").Effect} Effect */
/** @typedef {import("./contract").ModelError} ModelError */

/** Identifier of the element that shows refusals. */
const TROUBLE = "physics-trouble";

/** Milliseconds after which a running fit gets a button that stops it. */
const SLOW = 1500;

/** Steps of a parameter's slider. */
const STEPS = 1000;

/**
 * @param {import("./server.js").Server} server
 * @param {{error: (error: ModelError) => void, begin: (overview: import("./contract").Overview) => Promise<void>}} page
 *   gets each new error, and the overview after a new comparison of the readings
 */
export function physicsOf(server, page) {
  /** @type {Effect[]} */
  let effects = [];
  /** Effects that the diagnosis names, and their rivals. @type {string[]} */
  let found = [];
  /** @type {string[]} */
  let rivals = [];
  /** The baseline of the comparison. */
  let compared = "";
  /** The error of the model without effects, for the bars. */
  let start = 0;
  /** Effects that are switched on here, until the server has accepted them. @type {string[] | null} */
  let pending = null;
  /** What-if values: "effect parameter" → value. @type {Map<string, number>} */
  const whatIf = new Map();

  /** The error whose parameters are shown. @type {ModelError | null} */
  let drawn = null;
  let slow = 0;
  byId("stop").addEventListener("click", () => trying(TROUBLE, () => server.post("cancel")));

  const on = () => effects.filter((each) => each.on).map((each) => each.name);

  const switching = latest(async (/** @type {string[]} */ names) => {
    const taken = await trying(TROUBLE, async () => {
      whatIf.clear();
      page.error(await server.post("switch", { effects: names }));
    });
    if (pending === names) pending = null;
    // If the server refuses, the previous effects stay on.
    if (!taken) take(await server.get("effects").catch(() => effects));
  });

  /** The effect that was switched on last, until its parameters are shown. */
  let turned = "";

  /** @param {string} name @param {boolean} wanted */
  const turn = (name, wanted) => {
    turned = wanted ? name : "";
    effects = effects.map((each) => (each.name === name ? { ...each, on: wanted } : each));
    pending = on();
    void switching(pending);
  };

  const supposing = latest(async (/** @type {{effect: string, parameter: string, value: number}} */ asked) => {
    await trying(TROUBLE, async () => page.error(await server.post("what-if", asked)));
  });

  /** The row of each effect, and the function that updates the row. @type {Map<string, {item: HTMLLIElement, update: (effect: Effect) => void}>} */
  let lines = new Map();

  const rows = (anew = false) => {
    const old = lines;
    lines = new Map(effects.map((each) => [each.name, old.get(each.name) ?? row(each)]));
    for (const each of effects) lines.get(each.name)?.update(each);
    const list = byId("effects");
    const items = order(anew).map((each) => /** @type {{item: HTMLLIElement}} */ (lines.get(each.name)).item);
    if (items.length === list.children.length && items.every((item, place) => item === list.children[place])) return;
    const focused = document.activeElement;
    list.replaceChildren(...items);
    if (focused instanceof HTMLElement && list.contains(focused)) focused.focus({ preventScroll: true });
  };

  /** Whether rows keep their places, so that no row moves while a user clicks its switch. */
  let kept = false;

  /** Order of the rows: effects of the verdict, then by the error with the effect alone; undetectable effects last. */
  const order = (anew = false) => {
    const places = [...byId("effects").children].map((each) => each.id);
    const tried = effects.length > 0 && effects.every((each) => each.tried || each.given || !each.visible);
    kept ||= effects.some((each) => each.on && !each.given);
    const held = kept || !tried || byId("catalogue").matches(":focus-within");
    if (!anew && places.length === effects.length && held) {
      const place = (/** @type {Effect} */ each) => places.indexOf(`row-${each.name}`);
      return [...effects].sort((a, b) => place(a) - place(b));
    }
    kept ||= tried;
    const rank = (/** @type {Effect} */ each) =>
      found.includes(each.name) ? -1 : each.visible ? (each.alone_noise ?? 1e9) : 1e12;
    return [...effects].sort((a, b) => rank(a) - rank(b));
  };

  /** @param {Effect} effect */
  const row = ({ name, sentence, sees_words: sees, sees_of: seesOf, own, given }) => {
    const id = `effect-${name}`;
    const box = element("input", { type: "checkbox", role: "switch", id, "aria-describedby": `${id}-words` });
    box.disabled = given;
    box.addEventListener("change", () => turn(name, box.checked));
    const size = element("span", {}, sees);
    const seen = element("div", { class: "seen" }, size, element("small", {}, spacedIn(seesOf)));
    const words = element("div", { class: "words", id: `${id}-words` }, sentence.replaceAll("``", ""));
    const rival = element(
      "span",
      { class: "rival", title: "These readings do not distinguish this effect from the verdict's effect" },
      "rival",
    );
    const label = element("label", { for: id }, name, " ", rival);
    if (own) label.append(element("span", { class: "rival" }, "own"));
    const bar = element("div", { class: "alone" });
    const item = element(
      "li",
      { id: `row-${name}` },
      box,
      label,
      words,
      seen,
      bar,
      element("div", { class: "parameters", id: `${id}-parameters` }),
    );
    const update = (/** @type {Effect} */ effect) => {
      box.checked = effect.on;
      rival.hidden = !rivals.includes(name);
      size.textContent = effect.sees_words;
      item.classList.toggle("unseen-by-data", !effect.visible);
      alone(bar, effect.alone_noise);
    };
    return { item, update };
  };

  /** Draw the error with an effect alone. @param {HTMLElement} box @param {number | null} value */
  const alone = (box, value) => {
    if (value === null) return box.replaceChildren();
    const fill = element("i");
    fill.style.width = `${Math.min(100, (100 * value) / start)}%`;
    box.replaceChildren(fill, element("span", {}, `${ratio(value)} ×`));
  };

  /** @param {ModelError} error */
  const parameters = (error) => {
    start ||= error.noise_ratio;
    clearTimeout(slow);
    byId("stop").hidden = true;
    if (error.provisional) slow = setTimeout(() => tell("stop", "Stop the fit"), SLOW);
    // Sliders keep the values that a user set, and show the intervals of the fit.
    if (error.what_if) return;
    const names = error.effects.map((each) => `effect-${each.name}-parameters`);
    for (const place of document.querySelectorAll(".parameters"))
      if (!names.includes(place.id)) place.replaceChildren();
    // The fit sets which parameters of an effect are free.
    if (error.provisional) return;
    // Intervals stay while effects are switched: only new rows have no interval yet.
    const same = error === drawn;
    drawn = error;
    if (!same) for (const place of document.querySelectorAll(".parameters")) place.replaceChildren();
    for (const fitted of error.effects) {
      const place = document.getElementById(`effect-${fitted.name}-parameters`);
      if (!place || place.children.length) continue;
      if (!fitted.supported && fitted.said) place.append(element("p", { class: "caution" }, fitted.said));
      place.append(...fitted.parameters.map((each) => parameter(fitted.name, each)));
      if (fitted.parameters.length) {
        const reset = element("button", { type: "button", hidden: "" }, "Reset to the fit");
        for (const line of place.querySelectorAll(".parameter"))
          line.addEventListener("input", () => {
            reset.hidden = false;
          });
        reset.addEventListener("click", () =>
          trying(TROUBLE, async () => {
            whatIf.clear();
            page.error(await server.post("what-if", {}));
          }),
        );
        place.append(reset);
      }
      if (fitted.name === turned) {
        turned = "";
        place.parentElement?.scrollIntoView({ block: "nearest" });
      }
    }
  };

  /** @param {string} effect @param {import("./contract").Parameter} fitted */
  const parameter = (effect, fitted) => {
    const key = `${effect} ${fitted.name}`;
    const [least, greatest] = fitted.bounds;
    const value = whatIf.get(key) ?? fitted.value;
    const unit = fitted.unit && fitted.unit !== "1" ? ` ${fitted.unit}` : "";
    const slider = element("input", {
      type: "range",
      min: "0",
      max: String(STEPS),
      step: "1",
      "aria-label": `What if ${fitted.name} of ${effect}: ${fitted.words}`,
    });
    slider.value = String(Math.round((STEPS * (value - least)) / (greatest - least || 1)));
    const now = element("output", {});
    const fit = element("span", { class: "quiet" }, `fit ${fitted.fit}`);
    if (fitted.low !== null && fitted.high !== null)
      fit.title = `95 % interval: ${readable(fitted.low)} to ${readable(fitted.high)}${unit}`;
    const line = element(
      "div",
      { class: "parameter" },
      element("span", { title: fitted.name }, spacedIn(fitted.words)),
      slider,
      now,
      fit,
    );
    const write = (/** @type {number} */ number) => {
      now.textContent = `${readable(number, 3)}${unit}`;
      slider.setAttribute("aria-valuetext", now.textContent);
      const outside = (fitted.low !== null && number < fitted.low) || (fitted.high !== null && number > fitted.high);
      line.classList.toggle("outside", whatIf.has(key) && outside);
    };
    slider.addEventListener("input", () => {
      const number = least + ((greatest - least) * Number(slider.value)) / STEPS;
      whatIf.set(key, number);
      write(number);
      void supposing({ effect, parameter: fitted.name, value: number });
    });
    write(value);
    return line;
  };

  /** Show the model of the fresh display in the comparison. @param {string} name */
  const baseline = (name) => {
    const choice = input("baseline");
    choice.value = compared = name;
    choice.title = `The model knows ${choice.querySelector(`[value="${name}"]`)?.getAttribute("title")}.`;
  };
  input("baseline").addEventListener("change", async () => {
    const before = compared;
    const taken = await trying(TROUBLE, async () =>
      page.begin(await server.post("baseline", { baseline: input("baseline").value })),
    );
    if (!taken) baseline(before);
  });

  const ended = () => {
    byId("finding").hidden = true;
    input("find").disabled = false;
  };

  byId("find").addEventListener("click", async () => {
    byId("verdict").replaceChildren();
    byId("finding").hidden = false;
    input("find").disabled = true;
    /** @type {HTMLProgressElement} */ (byId("find-progress")).removeAttribute("value");
    byId("find-what").textContent = "";
    byId("cancel").focus();
    if (!(await trying(TROUBLE, () => server.post("find")))) ended();
  });
  byId("cancel").addEventListener("click", () => {
    byId("find-what").textContent = "stopping …";
    void trying(TROUBLE, () => server.post("cancel"));
  });

  /** Add a user's own effect, and switch it on in addition to other effects. */
  const add = async (/** @type {unknown} */ body, /** @type {Record<string, unknown>} */ query = {}) =>
    trying(TROUBLE, async () => {
      const known = new Set(effects.map((each) => each.name));
      const list = await server.post("own", body, query);
      // A changed file may declare other parameters of its effects.
      for (const each of effects.filter(({ own }) => own)) lines.delete(each.name);
      take(list);
      for (const { name } of effects.filter((each) => !known.has(each.name))) turn(name, true);
      rows();
    });
  byId("own").addEventListener("submit", async (event) => {
    event.preventDefault();
    const expression = input("own-line").value.trim();
    if (!expression) return;
    const taken = new Set(effects.map((each) => each.name));
    let number = 1;
    while (taken.has(`own-${number}`)) number += 1;
    if (await add({ name: `own-${number}`, expression })) input("own-line").value = "";
  });
  const own = (/** @type {File} */ file) => {
    const dialog = /** @type {HTMLDialogElement} */ (byId("trust"));
    byId("trust-name").textContent = file.name;
    dialog.returnValue = "no";
    dialog.onclose = () => {
      if (dialog.returnValue === "yes") void add(file, { name: file.name, trusted: "yes" });
    };
    dialog.showModal();
  };
  input("own-file").addEventListener("change", () => {
    const file = input("own-file").files?.[0];
    if (file) own(file);
    input("own-file").value = "";
  });

  /** @param {Effect[]} list */
  const take = (list) => {
    const names = pending;
    effects = names ? list.map((each) => ({ ...each, on: each.given || names.includes(each.name) })) : list;
    rows();
  };

  return {
    own,
    /** Another session has begun. */
    async begin(/** @type {import("./contract").Overview} */ overview) {
      start = 0;
      kept = false;
      lines.clear();
      byId("effects").replaceChildren();
      rivals = [];
      found = [];
      whatIf.clear();
      byId("verdict").replaceChildren();
      input("find").disabled = !overview.can_diagnose;
      const choices = Object.entries(overview.baselines).map(([name, words]) =>
        element("option", { value: name, title: words }, name),
      );
      input("baseline").replaceChildren(...choices);
      baseline(overview.baseline);
      tell(TROUBLE);
      await trying(TROUBLE, async () => take(await server.get("effects")));
    },
    effects: take,
    parameters,
    /** @param {{done: number, of: number}} progress */
    progress({ done, of }) {
      const bar = /** @type {HTMLProgressElement} */ (byId("find-progress"));
      bar.max = of;
      bar.value = done;
      byId("find-what").textContent = `${done} of ${of} effects tried`;
    },
    /** @param {import("./contract").Verdict} verdict */
    verdict(verdict) {
      rivals = verdict.rivals.flat().filter((each) => !verdict.effects.includes(each));
      found = verdict.effects;
      effects = effects.map((each) => ({ ...each, on: verdict.effects.includes(each.name) }));
      rows(true);
      byId("catalogue").scrollTop = 0;
      const parts = [element("p", {}, element("b", {}, `${verdict.name}: `), spacedIn(verdict.sentence))];
      const button = element("button", { type: "button", id: "patch-list" }, "Patch list");
      button.addEventListener("click", () =>
        trying(TROUBLE, async () => {
          const response = await server.fetch(server.address("take", { what: "patches" }));
          save(await response.blob(), "patches.csv");
        }),
      );
      const next = `What to measure next${verdict.next ? `: ${spacedIn(verdict.next)}` : ""} `;
      parts.push(element("p", { class: "quiet" }, next, button));
      if (verdict.remarks.length) parts.push(element("p", { class: "quiet" }, spacedIn(verdict.remarks.join(" "))));
      byId("verdict").replaceChildren(...parts);
    },
    ended,
    /** @param {string} sentence */
    failed(sentence) {
      ended();
      tell(TROUBLE, sentence);
    },
  };
}
