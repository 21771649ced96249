// Properties of the window and the screen that change an image's pixels or their look, as far as a page can read them.
// A page cannot read the screen's colour profile.

const media = {
  gamut: "(color-gamut: p3)",
  hdr: "(dynamic-range: high)",
  inverted: "(inverted-colors: inverted)",
  forced: "(forced-colors: active)",
};

// The colours of colours.png, by the rule that generated it.
const drawn = (x, y) => [(17 * x) % 256, (255 - 17 * y + 256) % 256, (73 * (x + 16 * y)) % 256, 255];

let altered = false;

/** Read the pixels of colours.png, to detect a browser that changes pixels. */
export async function readBack() {
  const image = new Image();
  image.src = "colours.png";
  await image.decode();
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 16;
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  const read = context.getImageData(0, 0, 16, 16).data;
  altered = false;
  for (let y = 0; y < 16; y += 1) {
    for (let x = 0; x < 16; x += 1) {
      altered ||= drawn(x, y).some((value, part) => read[4 * (16 * y + x) + part] !== value);
    }
  }
}

/** Reasons against reading on this screen: identifiers, each with a sentence. */
export function warnings([width, height], room) {
  const ratio = devicePixelRatio;
  const found = new Map();
  if (visualViewport && Math.abs(visualViewport.scale - 1) > 0.001) {
    found.set("pinched", "The page is magnified by pinching: images are blurred. Pinch back until it fills the window.");
  }
  if (!Number.isInteger(ratio)) {
    found.set(
      "zoom",
      `The browser zooms, or the system scales, by ${ratio.toFixed(2)}: images may be blurred. Press Ctrl 0 (⌘ 0).`,
    );
  } else if (ratio !== 1) {
    found.set(
      "scaled",
      `${ratio} × ${ratio} screen pixels make one of the browser's. Images are still shown pixel for pixel, so they ` +
        "look small. If you have zoomed in, press Ctrl 0 (⌘ 0).",
    );
  }
  if (room.width * ratio < width || room.height * ratio < height) {
    found.set(
      "small",
      `Images of up to ${width} × ${height} pixels do not fit into this window. Press F for full screen; ` +
        "else drag them, or move them with the arrow keys.",
    );
  }
  if (matchMedia(media.gamut).matches) {
    found.set("gamut", "This screen shows more colours than sRGB. Set it to its sRGB mode.");
  }
  if (matchMedia(media.hdr).matches) found.set("hdr", "This screen is in a high dynamic range mode. Turn HDR off.");
  if (matchMedia(media.inverted).matches) found.set("inverted", "The system inverts colours. Turn that off.");
  if (matchMedia(media.forced).matches) found.set("forced", "The system forces colours on pages. Turn contrast themes off.");
  if (altered) {
    found.set("altered", "This browser changes the pixels of images, perhaps against tracking. Use another one.");
  }
  return found;
}

/** Call a function when the window or the screen has changed. */
export function watch(changed) {
  addEventListener("resize", changed);
  visualViewport?.addEventListener("resize", changed);
  for (const query of Object.values(media)) matchMedia(query).addEventListener("change", changed);
  // On another screen the pixel ratio may change without the window's size; each media query reports one change.
  const ratio = () => {
    const query = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
    query.addEventListener("change", () => { ratio(); changed(); }, { once: true });
  };
  ratio();
}

export const state = () => ({
  ratio: devicePixelRatio,
  pinch: visualViewport?.scale ?? 1,
  window: [innerWidth, innerHeight],
  screen: [screen.width, screen.height],
});
