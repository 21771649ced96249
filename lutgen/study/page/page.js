// A reading session: screens, keys, and the time for which each image was seen.
//
// The time to score runs from the first paint of the image to the choice of the diagnosis that is then confirmed.
// A choice that is undone or changed does not stop the time. Pauses do not count. Only the page's own clock is used,
// which does not depend on the computer's clock.

import * as picture from "./image.js";
import * as screenOf from "./screen.js";

const $ = (id) => document.getElementById(id);
const tab = crypto.randomUUID();
const accepted = new Set();

let setup = null;
let trial = null;
let held = false;
let busy = false;
let again = null;

class Refused extends Error {
  constructor(why, message) {
    super(message);
    this.why = why;
  }
}

async function ask(what, body = {}, options = {}) {
  let reply;
  try {
    reply = await fetch(what, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ tab, ...body }),
      ...options,
    });
  } catch {
    throw new Refused("gone", "lutgen does not answer: it was stopped, or has ended. What you saved with Enter is kept.");
  }
  const content = await reply.json().catch(() => ({ why: "gone", error: "lutgen gave no answer that makes sense." }));
  if (!reply.ok) throw new Refused(content.why, content.error);
  return content;
}

// Screens

const screens = ["opening", "welcome", "practised", "paused", "warned", "elsewhere", "trouble", "done"];
const mains = {
  welcome: "begin",
  practised: "start",
  paused: "continue",
  warned: "accept",
  elsewhere: "take",
  trouble: "retry",
};

function show(name) {
  document.body.dataset.screen = name;
  for (const each of screens) $(each).hidden = each !== name;
  $("reading").hidden = !["reading", "paused", "warned"].includes(name);
  if (mains[name]) $(mains[name]).focus();
  else document.activeElement?.blur();
}

const announce = (text) => {
  $("announce").textContent = text;
};

const titles = {
  full: "Not saved yet",
  gone: "No connection",
  fault: "This image cannot be shown",
  past: "This page is behind",
  bad: "Something is wrong",
};

function troubled(error, retry) {
  if (!(error instanceof Refused)) throw error;
  if (error.why === "tab") return lost();
  picture.hide();
  again = error.why === "past" ? () => location.reload() : retry;
  $("trouble-title").textContent = titles[error.why] ?? titles.bad;
  $("trouble-text").textContent = error.message;
  return show("trouble");
}

/** Do one action at a time. If an action is refused, show the reason and offer to try again. */
async function attempt(action) {
  if (busy) return;
  busy = true;
  document.body.ariaBusy = "true";
  try {
    await action();
  } catch (error) {
    troubled(error, () => attempt(error.again ?? action));
  } finally {
    busy = false;
    document.body.ariaBusy = "false";
    if (document.hidden) pause("hidden", performance.now());
  }
}

// One tab at a time

function lost() {
  held = false;
  picture.hide();
  $("take").disabled = true;
  show("elsewhere");
}

async function open() {
  for (let left = 3; ; left -= 1) {
    try {
      setup = await ask("claim");
      break;
    } catch (error) {
      // After a reload, the previous page may still hold the session.
      if (error.why !== "tab" || left === 0) throw error;
      await new Promise((resolve) => setTimeout(resolve, 150));
    }
  }
  held = true;
  trial = null;
  await screenOf.readBack();
  welcome();
}

setInterval(async () => {
  try {
    if (held) await ask("beat");
    else if (document.body.dataset.screen === "elsewhere") {
      const { free } = await ask("look");
      if (free && $("take").disabled) {
        $("take").disabled = false;
        $("take").focus();
      } else if (!free) $("take").disabled = true;
    }
  } catch (error) {
    // A missing answer of lutgen is reported when an answer is saved.
    if (error.why === "tab") lost();
  }
}, 2000);

addEventListener("pagehide", () => {
  if (held) ask("leave", {}, { keepalive: true }).catch(() => {});
  held = false;
});
addEventListener("pageshow", (event) => {
  if (event.persisted) location.reload();
});

// Reasons against reading on this screen

const room = () => ({ width: innerWidth, height: innerHeight - Math.max($("reading").querySelector("footer").offsetHeight, 104) });
const warnings = () => screenOf.warnings(setup.largest, room());

function listWarnings(found) {
  for (const place of document.querySelectorAll(".warnings")) {
    const list = document.createElement("ul");
    for (const sentence of found.values()) {
      list.append(Object.assign(document.createElement("li"), { textContent: sentence }));
    }
    const lead = Object.assign(document.createElement("p"), { textContent: "Put this right before you go on, if you can:" });
    place.replaceChildren(...(found.size ? [lead, list] : []));
  }
}

async function accept() {
  const found = [...warnings().keys()];
  if (found.length) await ask("note", { kind: "accepted", said: { warnings: found, ...screenOf.state() } });
  for (const each of found) accepted.add(each);
}

async function changed() {
  picture.place();
  if (!setup) return;
  const found = warnings();
  listWarnings(found);
  const fresh = [...found.keys()].filter((each) => !accepted.has(each));
  if (document.body.dataset.screen === "reading" && fresh.length) {
    pause("warning", performance.now(), "warned");
    await ask("note", { kind: "warned", said: { warnings: fresh, ...screenOf.state() } }).catch(() => {});
  }
}

// Welcome, practice, end

const key = (text) => Object.assign(document.createElement("kbd"), { textContent: text });
const images = (count) => `${count} ${count === 1 ? "image" : "images"}`;
const spacePauses = () => !setup.categories.some((each) => each.key === " ");
const letterPauses = () => !setup.categories.some((each) => each.key.toLowerCase() === "p");

function welcome() {
  const left = setup.images - setup.read;
  const toPractise = setup.practice - setup.practised;
  $("who").textContent = setup.reader;
  $("title").textContent = `Reading session ${setup.session} of ${setup.sessions}`;
  const going = setup.read || setup.practised;
  const first = toPractise ? `First ${images(toPractise)} to practise on, which ${toPractise === 1 ? "does" : "do"} not count; then ` : "";
  const now = first ? `${first}${images(left)}.` : `${images(left)} to read.`;
  $("task").textContent = going && setup.read ? `Welcome back: ${setup.read} of ${setup.images} are saved. ${images(left)} are left.` : now;
  $("keys").replaceChildren(...setup.categories.flatMap((each, i) => [i ? ", " : "", key(each.key), ` ${each.name} (${side(each)})`]));
  const [lowest, highest] = setup.ease;
  const ten = highest >= 10 && lowest <= 10 ? [", ", key("0"), " is 10"] : [];
  $("ease-keys").replaceChildren(key(`${lowest}`), ` very hard to ${highest} very easy`, ...ten);
  $("pause-keys").replaceChildren(...(letterPauses() ? [key("P"), " or "] : []), key("Space"));
  $("pause-key").textContent = letterPauses() ? "P" : "Space";
  buttons("diagnosis", setup.categories.map((each) => ({ value: each.name, label: each.name, mark: each.key, small: side(each) })));
  const marks = Array.from({ length: highest - lowest + 1 }, (_, i) => lowest + i);
  const ends = { [lowest]: "hard", [highest]: "easy" };
  buttons("ease", marks.map((value) => ({ value, label: `${value}`, mark: value === 10 ? "0" : "", small: ends[value] ?? "" })));
  listWarnings(warnings());
  show("welcome");
}

const side = (category) => (category.positive ? "positive" : "negative");

function buttons(group, items) {
  const made = items.map(({ value, label, mark, small }) => {
    const button = document.createElement("button");
    const line = Object.assign(document.createElement("b"), { textContent: mark ? ` ${label}` : label });
    if (mark) line.prepend(key(mark));
    button.append(line);
    button.append(Object.assign(document.createElement("small"), { textContent: small || "\u00a0" }));
    button.setAttribute("aria-label", [label, small].filter(Boolean).join(", "));
    button.dataset.value = value;
    button.addEventListener("click", (event) => {
      if (group === "diagnosis") choose(value, event.timeStamp);
      else rate(value);
      // After a mouse click, keys go to the page again.
      if (event.detail) button.blur();
    });
    return button;
  });
  $(group).querySelector("div").replaceChildren(...made);
}

async function finish({ read, following }) {
  picture.clear();
  trial = null;
  $("done-text").textContent = `Session ${setup.session} is complete: all ${images(read)} are saved. ${following}`;
  show("done");
  held = false;
  await ask("leave").catch(() => {});
}

// An image

async function next() {
  try {
    await showNext();
  } catch (error) {
    // Earlier steps, such as saving the answer, must not be repeated.
    throw Object.assign(error, { again: next });
  }
}

async function showNext() {
  picture.hide();
  const given = await ask("next");
  if (given.done) {
    await finish(given);
    return;
  }
  trial = { ...given, start: null, paint: "animation-frame", category: null, ease: null, decided: null, first: null, pauses: [], pausedAt: null };
  const mine = trial;
  $("badge").hidden = !given.practice;
  $("place").textContent = `${given.number} of ${given.of}`;
  Object.assign($("bar"), { max: given.of, value: given.number - 1 });
  refresh();
  show("reading");
  const label = `${given.practice ? "Practice image" : "Image"} ${given.number} of ${given.of}`;
  let start;
  try {
    start = await picture.display(`picture/${given.picture}`, label, (time) => {
      if (mine.first === null && !mine.pauses.length) Object.assign(mine, { start: time, paint: "element-timing" });
    });
  } catch {
    throw new Refused("gone", "The image did not arrive. What you saved with Enter is kept.");
  }
  mine.start ??= start;
  announce(label);
  refresh();
  if (document.hidden) pause("hidden", mine.start);
  else await changed();
}

/** Seconds from the first paint until a time of the page's clock, without pauses. */
function looked(until) {
  const hidden = trial.pauses.reduce((sum, [from, to]) => sum + Math.max(0, Math.min(to, until) - from), 0);
  return Math.max(0, (until - trial.start - hidden) / 1000);
}

const reading = () => document.body.dataset.screen === "reading" && trial?.start != null && !busy;

function choose(name, when) {
  if (!reading() || trial.category === name) return;
  trial.category = name;
  trial.decided = looked(when);
  trial.first ??= trial.decided;
  announce(`Diagnosis ${name}`);
  refresh();
}

function rate(mark) {
  if (!reading() || trial.category === null) return;
  trial.ease = mark;
  announce(`Ease of reading ${mark}`);
  refresh();
}

function takeBack() {
  if (!reading()) return;
  if (trial.ease !== null) trial.ease = null;
  else trial.category = trial.decided = null;
  refresh();
}

function refresh() {
  const { category, ease } = trial;
  const press = (group, value) => {
    for (const button of $(group).querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(button.dataset.value === String(value)));
      button.disabled = trial.start === null || (group === "ease" && category === null);
    }
    $(group).classList.toggle("set", value !== null);
  };
  press("diagnosis", category);
  press("ease", ease);
  $("diagnosis").classList.toggle("now", category === null);
  $("ease").classList.toggle("now", category !== null && ease === null);
  $("confirm").disabled = ease === null;
  $("back").disabled = category === null;
}

async function save() {
  const { number, practice, category, ease, decided, first, pauses, paint } = trial;
  await ask("answer", {
    number,
    practice,
    category,
    ease,
    paint,
    seconds: decided,
    first_choice_seconds: first,
    pauses: pauses.length,
    paused_seconds: pauses.reduce((sum, [from, to]) => sum + to - from, 0) / 1000,
  });
  if (practice && number === trial.of) {
    picture.clear();
    trial = null;
    $("from-now").textContent = `From now on every answer counts: ${images(setup.images)}. Take a breath; the time starts with the first image.`;
    show("practised");
  } else await next();
}

/** Save the answer. If saving fails, the same answer is sent again: its time has stopped before. */
function confirm() {
  if (reading() && trial.ease !== null) attempt(save);
}

// Pauses

function pause(why, when, screen = "paused") {
  if (document.body.dataset.screen !== "reading" || trial?.start == null) return;
  trial.pausedAt = Math.max(when, trial.start);
  picture.hide();
  show(screen);
  ask("note", { kind: "paused", said: { why } }).catch(() => {});
}

async function goOn() {
  show("reading");
  const now = await picture.reveal();
  trial.pauses.push([trial.pausedAt, now]);
  const seconds = (now - trial.pausedAt) / 1000;
  trial.pausedAt = null;
  await ask("note", { kind: "continued", said: { seconds } }).catch(() => {});
  refresh();
}

document.addEventListener("visibilitychange", () => {
  if (document.hidden && !busy) pause("hidden", performance.now());
});

// Keys and buttons

const fullScreen = () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen?.())?.catch(() => {});

const presses = {
  begin: () => attempt(async () => { await accept(); await next(); }),
  start: () => attempt(next),
  continue: () => attempt(goOn),
  accept: () => attempt(async () => { await accept(); await goOn(); }),
  take: () => attempt(open),
  retry: () => again?.(),
  confirm,
  back: takeBack,
  pause: (event) => { if (!busy) pause("asked", event.timeStamp); },
};
for (const [id, action] of Object.entries(presses)) {
  $(id).addEventListener("click", (event) => {
    action(event);
    if (event.detail) event.currentTarget?.blur?.();
  });
}

function keyWhileReading(event) {
  const category = setup.categories.find((each) => each.key.toLowerCase() === event.key.toLowerCase());
  const [lowest, highest] = setup.ease;
  const mark = /^[0-9]$/.test(event.key) ? (event.key === "0" && lowest > 0 ? 10 : Number(event.key)) : NaN;
  if (event.key === "Backspace") takeBack();
  else if (event.key === "Enter") confirm();
  else if (trial?.category === null && category) choose(category.name, event.timeStamp);
  else if (mark >= lowest && mark <= highest) rate(mark);
  else if ((letterPauses() && event.key.toLowerCase() === "p") || (event.key === " " && spacePauses())) presses.pause(event);
  else if (event.key.toLowerCase() === "f") fullScreen();
  else return picture.moveByKey(event.key);
  return true;
}

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return;
  if (event.repeat && !event.key.startsWith("Arrow")) {
    // A key that is held down counts once: it must not act on the next screen too.
    event.preventDefault();
    return;
  }
  // Enter and Space press a button that has the focus from the Tab key.
  const onButton = document.activeElement?.tagName === "BUTTON" && (event.key === "Enter" || event.key === " ");
  const name = document.body.dataset.screen;
  if (name === "reading") {
    if (!onButton && keyWhileReading(event)) event.preventDefault();
  } else if (event.key.toLowerCase() === "f") fullScreen();
  else if (name === "paused" && (event.key === " " || (letterPauses() && event.key.toLowerCase() === "p"))) {
    event.preventDefault();
    presses.continue();
  } else if (!onButton && event.key === "Enter" && mains[name] && !$(mains[name]).disabled) {
    event.preventDefault();
    presses[mains[name]](event);
  }
});

screenOf.watch(changed);
attempt(open);
