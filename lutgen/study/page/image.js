// The image: shown with one image pixel for one screen pixel, and moved if it is larger than the window.

const stage = document.getElementById("stage");
let image = null;
let offset = [0, 0];

const clamp = (value, most) => Math.min(most, Math.max(-most, value));

/** Position the image on whole pixels of the screen. */
export function place() {
  if (!image) return;
  const ratio = devicePixelRatio;
  const size = [image.naturalWidth / ratio, image.naturalHeight / ratio];
  const room = [stage.clientWidth, stage.clientHeight];
  offset = offset.map((value, axis) => clamp(value, Math.max(0, (size[axis] - room[axis]) / 2)));
  const [left, top] = offset.map(
    (value, axis) => Math.round(((room[axis] - size[axis]) / 2 + value) * ratio) / ratio,
  );
  // A transform, since layout rounds a width that is not a whole number of the browser's pixels.
  image.style.transform = `translate(${left}px, ${top}px) scale(${1 / ratio})`;
  stage.classList.toggle("larger", size.some((value, axis) => value > room[axis]));
}

export function move(x, y) {
  offset = [offset[0] + x, offset[1] + y];
  place();
}

/** Move the image by an arrow key, a tenth of the window at a time; return false for another key. */
export function moveByKey(key) {
  const step = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
  if (!step) return false;
  move((step[0] * stage.clientWidth) / 10, (step[1] * stage.clientHeight) / 10);
  return true;
}

export function hide() {
  stage.classList.add("hidden");
}

const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));

/** Show the hidden image, and return the time when it was on the screen. */
export async function reveal() {
  stage.classList.remove("hidden");
  await frame();
  return await frame();
}

/**
 * Show another image. Return the time of its first paint: the time of the frame after the paint.
 * If the browser keeps its own record of the paint, `painted` is called with the recorded time a moment later.
 */
export async function display(source, label, painted) {
  const next = new Image();
  next.src = source;
  next.alt = label;
  next.draggable = false;
  next.setAttribute("elementtiming", "image");
  await next.decode();
  if (window.PerformanceObserver?.supportedEntryTypes?.includes("element")) {
    const observer = new PerformanceObserver((list) => {
      for (const entry of list.getEntries()) {
        if (entry.element !== next || !entry.renderTime) continue;
        painted(entry.renderTime);
        observer.disconnect();
      }
    });
    observer.observe({ type: "element" });
  }
  image = next;
  offset = [0, 0];
  stage.replaceChildren(next);
  place();
  return await reveal();
}

export function clear() {
  image = null;
  stage.replaceChildren();
}

let grabbed = [0, 0];
stage.addEventListener("pointerdown", (event) => {
  if (event.button !== 0) return;
  grabbed = [event.clientX, event.clientY];
  stage.setPointerCapture(event.pointerId);
  event.preventDefault();
});
stage.addEventListener("pointermove", (event) => {
  if (!stage.hasPointerCapture(event.pointerId)) return;
  move(event.clientX - grabbed[0], event.clientY - grabbed[1]);
  grabbed = [event.clientX, event.clientY];
});
