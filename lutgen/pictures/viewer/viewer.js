// Draw a picture through 3D tables by WebGL2: wiper between the parts, map of ΔE2000, zoom and pan.
//
// `lutgen explore` and the page of `lutgen report` share this module, so it imports no other module. A table holds the
// LUT that `lutgen build` writes, in 16 bits. The shader fetches the table's numbers unfiltered (texelFetch) and
// interpolates tetrahedrally. OpenColorIO's own GLSL ES 3.0 shader is not used: it reads float textures, which WebGL2
// filters on some machines only, and it would have to be written and compiled again for each hour.

/** @typedef {{size: number, values: Uint16Array<ArrayBuffer>, differences?: boolean}} Table size³ × 4 numbers, red fastest: code values, 65280 for 1, and ΔE2000 as 65535 for 100, unless `differences` is false */
/** @typedef {{first: Table, second: Table, share: number}} Blend both tables mixed: 0 is the first, 1 the second */

/** Colours of a map from 0 to its end: viridis, which is perceptually uniform. */
export const MAP_COLOURS = [
  "#440154",
  "#472d7b",
  "#3b528b",
  "#2c728e",
  "#21918c",
  "#28ae80",
  "#5ec962",
  "#addc30",
  "#fde725",
];

/** ΔE2000 of the largest number in a table's fourth channel. */
const DIFFERENCE = 100;

/** Number of code value 1 in a table. */
const WHITE = 65280;

/** Textures of the shader; the index of each is its texture unit. */
const UNITS = ["picture", "first", "second", "corrected"];

const CORNERS = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;

const COLOURS = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler3D;
precision highp sampler2D;

uniform sampler2D picture;
uniform usampler3D first, second, corrected;
uniform float share;      // share of the second table in the aged part
uniform vec2 cuts;        // left and right edge of the aged part, in pixels of the canvas
uniform vec2 origin;      // upper left corner of the picture, in pixels of the canvas
uniform float scale;      // pixels of the canvas for one pixel of the picture
uniform float height;     // height of the canvas
uniform vec2 reach;       // ΔE2000 at the end of the map's colours in the aged and in the corrected part; 0: the picture
uniform vec3 surround;
uniform vec3 colours[${MAP_COLOURS.length}];
out vec4 shown;

vec4 node(usampler3D table, ivec3 at) { return vec4(texelFetch(table, at, 0)) / vec4(vec3(${WHITE}.0), 65535.0); }

// Tetrahedral interpolation: from the cell's lower corner, along the axis of the largest share first.
vec4 through(usampler3D table, vec3 code) {
  int size = textureSize(table, 0).x;
  vec3 place = code * float(size - 1);
  ivec3 corner = min(ivec3(place), size - 2);
  vec3 part = place - vec3(corner);
  bool xy = part.x >= part.y, yz = part.y >= part.z, xz = part.x >= part.z;
  ivec3 most = xy && xz ? ivec3(1, 0, 0) : (!xy && yz ? ivec3(0, 1, 0) : ivec3(0, 0, 1));
  ivec3 least = yz && xz ? ivec3(0, 0, 1) : (!xy && !xz ? ivec3(1, 0, 0) : ivec3(0, 1, 0));
  float high = max(part.x, max(part.y, part.z)), low = min(part.x, min(part.y, part.z));
  float middle = dot(part, vec3(1.0)) - high - low;
  return node(table, corner) * (1.0 - high) + node(table, corner + most) * (high - middle)
    + node(table, corner + 1 - least) * (middle - low) + node(table, corner + 1) * low;
}

vec3 colour(float share) {
  float place = clamp(share, 0.0, 1.0) * float(colours.length() - 1);
  int below = min(int(place), colours.length() - 2);
  return mix(colours[below], colours[below + 1], place - float(below));
}

void main() {
  vec2 canvas = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec2 at = (canvas - origin) / scale;
  vec2 size = vec2(textureSize(picture, 0));
  // The derivatives that choose a mipmap must also be defined outside the picture.
  vec4 source = scale < 1.0 ? texture(picture, at / size) : texelFetch(picture, ivec2(clamp(at, vec2(0.0), size - 1.0)), 0);
  vec4 result = source;
  bool aged = canvas.x >= cuts.x;
  if (aged) {
    vec3 code = source.rgb;
    if (canvas.x >= cuts.y) result = through(corrected, code);
    else if (share == 0.0) result = through(first, code);
    else result = mix(through(first, code), through(second, code), share);
    float end = canvas.x >= cuts.y ? reach.y : reach.x;
    if (end > 0.0) result.rgb = colour(result.a * ${DIFFERENCE.toFixed(1)} / end);
  }
  bool inside = all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, size));
  shown = vec4(mix(surround, result.rgb, inside ? source.a : 0.0), 1.0);
}`;

/** Call `moved` when a slider over hours moves; keys move the slider by 100 or 1000 hours. @param {HTMLInputElement} slider @param {() => void} moved */
export function hourly(slider, moved) {
  slider.addEventListener("input", moved);
  slider.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -100, ArrowDown: -100, ArrowRight: 100, ArrowUp: 100, PageDown: -1000, PageUp: 1000 }[
      event.key
    ];
    if (!step) return;
    event.preventDefault();
    slider.value = String(Number(slider.value) + step);
    moved();
  });
}

/** The table that changes no colour. */
export function unchanged() {
  const values = new Uint16Array(32);
  for (let node = 0; node < 8; node += 1)
    values.set(
      [0, 1, 2].map((bit) => ((node >> bit) & 1) * WHITE),
      4 * node,
    );
  return { size: 2, values, differences: false };
}

/** @param {string} hex */
const rgb = (hex) => [1, 3, 5].map((from) => Number.parseInt(hex.slice(from, from + 2), 16) / 255);

const clamp = (/** @type {number} */ value, /** @type {number} */ low, /** @type {number} */ high) =>
  Math.min(Math.max(value, low), high);

/** A canvas with a wiper in an element; arrow keys, + and −, 0 and 1 move and zoom the picture. */
export class Viewer {
  /**
   * @param {HTMLElement} host is filled; its size does not depend on its content
   * @param {string[]} names of the parts from left to right: two or three
   */
  constructor(host, names) {
    this.host = host;
    host.classList.add("viewer");
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute(
      "aria-label",
      "The picture: arrow keys move it, plus and minus zoom, 0 fits it, 1 shows it pixel by pixel",
    );
    host.append(this.canvas);
    /** @type {ImageBitmap | ImageData | HTMLCanvasElement | null} */
    this.picture = null;
    this.size = [1, 1];
    /** @type {Blend} */
    this.aged = { first: unchanged(), second: unchanged(), share: 0 };
    /** @type {Table} */
    this.corrected = unchanged();
    /** ΔE2000 at the end of the map's colours; 0 shows the picture. */
    this.reach = 0;
    /** Pixels of the screen for one pixel of the picture; 0: the whole picture fits. */
    this.zoom = 0;
    this.centre = [0.5, 0.5];
    this.cuts = names.length > 2 ? [0.34, 0.67] : [0.5, 1];
    this.frame = 0;
    /** Called when the zoom or the size of the canvas has changed. */
    this.zoomed = () => {};
    this.bars = names.slice(1).map((name, place) => this.bar(place, names[place], name));
    this.tags = names.map((name) => this.tag(name));
    const gl = this.canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true });
    if (!gl)
      throw new Error(
        "This browser has no WebGL2, which draws the picture. Turn on hardware acceleration, or use another browser.",
      );
    this.gl = gl;
    this.program = gl.createProgram();
    /** @type {WebGLTexture[]} */
    this.textures = [];
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.program = gl.createProgram();
      this.begin();
    });
    this.begin();
    this.listen();
    new ResizeObserver(() => this.changed()).observe(host);
  }

  /** Compile the shader, and load the tables and the picture. */
  begin() {
    const { gl, program } = this;
    for (const [kind, text] of /** @type {[number, string][]} */ ([
      [gl.VERTEX_SHADER, CORNERS],
      [gl.FRAGMENT_SHADER, COLOURS],
    ])) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`The graphics driver does not compile the shader: ${gl.getProgramInfoLog(program)}`);
    }
    gl.useProgram(program);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, 0);
    gl.uniform3fv(this.place("colours"), MAP_COLOURS.flatMap(rgb));
    this.textures = UNITS.map(() => gl.createTexture());
    UNITS.forEach((name, unit) => {
      gl.uniform1i(this.place(name), unit);
    });
    this.load("first", this.aged.first);
    this.load("second", this.aged.second);
    this.load("corrected", this.corrected);
    if (this.picture) this.show(this.picture);
    this.changed();
  }

  /** @param {string} name of a uniform */
  place(name) {
    return this.gl.getUniformLocation(this.program, name);
  }

  /** @param {string} name @param {Table} table */
  load(name, { size, values }) {
    const gl = this.gl;
    const unit = UNITS.indexOf(name);
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_3D, this.textures[unit]);
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA16UI, size, size, size, 0, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, values);
  }

  /** Show another picture. @param {ImageBitmap | ImageData | HTMLCanvasElement} picture */
  show(picture) {
    const gl = this.gl;
    if (picture !== this.picture) this.zoom = 0;
    this.picture = picture;
    this.size = [picture.width, picture.height];
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.textures[0]);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    gl.generateMipmap(gl.TEXTURE_2D);
    this.changed();
  }

  /** Apply a table, or a blend of two tables, to the aged part. @param {Table} first @param {Table} second */
  age(first, second = first, share = 0) {
    if (first !== this.aged.first) this.load("first", first);
    if (second !== this.aged.second) this.load("second", second);
    this.aged = { first, second, share };
    this.changed();
  }

  /** Apply a table to the third part. @param {Table} table */
  correct(table) {
    this.corrected = table;
    this.load("corrected", table);
    this.changed();
  }

  /** Show the map of ΔE2000 with colours that end at `reach`; 0 shows the picture. @param {number} reach */
  map(reach) {
    this.reach = reach;
    this.changed();
  }

  /** Pixels of the screen for one pixel of the picture when the whole picture fits. */
  get fit() {
    return Math.min(this.canvas.width / this.size[0], this.canvas.height / this.size[1]);
  }

  get scale() {
    return this.zoom || this.fit;
  }

  /** Zoom around a fixed point (x, y), in pixels of the canvas; 0 fits the whole picture. @param {number} zoom */
  zoomTo(zoom, x = this.canvas.width / 2, y = this.canvas.height / 2) {
    const before = this.scale;
    const [left, top] = this.origin;
    const at = [(x - left) / before, (y - top) / before];
    this.zoom = zoom && Math.abs(zoom / this.fit - 1) > 0.01 ? clamp(zoom, Math.min(this.fit, 1) / 2, 32) : 0;
    const now = this.scale;
    this.centre = [
      (at[0] + (this.canvas.width / 2 - x) / now) / this.size[0],
      (at[1] + (this.canvas.height / 2 - y) / now) / this.size[1],
    ];
    this.changed();
    this.zoomed();
  }

  /** Move the picture by pixels of the canvas. @param {number} x @param {number} y */
  pan(x, y) {
    this.centre = [this.centre[0] - x / (this.scale * this.size[0]), this.centre[1] - y / (this.scale * this.size[1])];
    this.changed();
  }

  /** Upper left corner of the picture in whole pixels of the canvas, so that 1:1 stays sharp. */
  get origin() {
    const room = [this.canvas.width, this.canvas.height];
    return room.map((length, axis) => {
      const drawn = this.size[axis] * this.scale;
      const most = Math.max(length - drawn, 0) / 2;
      return Math.round(drawn <= length ? most : clamp(length / 2 - this.centre[axis] * drawn, length - drawn, 0));
    });
  }

  /** Left and right edge of the visible part of the picture, as shares of the canvas. */
  get span() {
    const left = this.origin[0];
    return [
      Math.max(left, 0) / this.canvas.width,
      Math.min(left + this.size[0] * this.scale, this.canvas.width) / this.canvas.width,
    ];
  }

  changed() {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.draw();
    });
  }

  draw() {
    const { gl, canvas } = this;
    const ratio = devicePixelRatio;
    const [width, height] = [this.host.clientWidth, this.host.clientHeight].map((length) =>
      Math.max(Math.round(length * ratio), 1),
    );
    if (canvas.width !== width || canvas.height !== height) {
      Object.assign(canvas, { width, height });
      this.zoomed();
    }
    if (!this.picture) return;
    const [left, right] = this.span;
    const cuts = this.cuts.map((cut) => left + cut * (right - left));
    this.bars.forEach((bar, number) => {
      bar.style.setProperty("left", `${100 * cuts[number]}%`);
    });
    this.placeTags([left, ...cuts, right]);
    gl.viewport(0, 0, width, height);
    this.textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(unit ? gl.TEXTURE_3D : gl.TEXTURE_2D, texture);
    });
    // When the last bar stands at the right edge, the edge belongs to the part left of the bar.
    gl.uniform2f(this.place("cuts"), cuts[0] * width, this.cuts[1] >= 1 ? 2 * width : cuts[1] * width);
    gl.uniform2f(this.place("origin"), this.origin[0], this.origin[1]);
    gl.uniform1f(this.place("share"), this.aged.share);
    gl.uniform1f(this.place("scale"), this.scale);
    gl.uniform1f(this.place("height"), height);
    const reaches = [this.aged.first, this.corrected].map((each) => (each.differences === false ? 0 : this.reach));
    gl.uniform2f(this.place("reach"), reaches[0], reaches[1]);
    const grey = getComputedStyle(this.host).getPropertyValue("--surround").trim() || "#777777";
    gl.uniform3fv(this.place("surround"), rgb(grey));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** @param {number} place @param {string} left @param {string} right */
  bar(place, left, right) {
    const bar = document.createElement("div");
    bar.className = "viewer-bar";
    bar.tabIndex = 0;
    bar.setAttribute("role", "slider");
    bar.setAttribute("aria-label", `Wiper between ${left} and ${right}, in percent from the left`);
    bar.setAttribute("aria-valuemin", "0");
    bar.setAttribute("aria-valuemax", "100");
    bar.setAttribute("aria-valuenow", String(Math.round(100 * this.cuts[place])));
    bar.addEventListener("keydown", (event) => {
      const step = {
        ArrowLeft: -0.01,
        ArrowDown: -0.01,
        ArrowRight: 0.01,
        ArrowUp: 0.01,
        PageDown: -0.1,
        PageUp: 0.1,
        Home: -1,
        End: 1,
      }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      this.wipe(place, this.cuts[place] + step);
    });
    this.host.append(bar);
    return bar;
  }

  /** Move a bar, which pushes the other bar. @param {number} place @param {number} cut share of the visible picture */
  wipe(place, cut) {
    const cuts = [...this.cuts];
    cuts[place] = clamp(cut, 0, 1);
    if (place === 0) cuts[1] = Math.max(cuts[1], cuts[0]);
    else cuts[0] = Math.min(cuts[0], cuts[1]);
    this.cuts = cuts;
    this.bars.forEach((bar, number) => {
      bar.setAttribute("aria-valuenow", String(Math.round(100 * cuts[number])));
    });
    this.changed();
  }

  /** @param {string} name */
  tag(name) {
    const tag = document.createElement("span");
    tag.className = "viewer-tag";
    tag.textContent = name;
    this.host.append(tag);
    return tag;
  }

  /** @param {number[]} edges of the parts, as shares of the canvas */
  placeTags(edges) {
    this.tags.forEach((tag, number) => {
      const [left, right] = [edges[number], edges[number + 1]].map((edge) => edge * this.host.clientWidth);
      tag.hidden = right - left < tag.textContent.length * 7 + 24;
      tag.style.setProperty("left", `${(left + right) / 2}px`);
    });
  }

  listen() {
    /** The dragged thing: a bar's number, or the picture (−1). @type {number | null} */
    let dragged = null;
    const canvas = this.canvas;
    const cutAt = (/** @type {PointerEvent} */ event) => {
      const { left, width } = canvas.getBoundingClientRect();
      const [from, to] = this.span;
      return ((event.clientX - left) / width - from) / (to - from);
    };
    this.host.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      const bar = this.bars.indexOf(/** @type {HTMLDivElement} */ (event.target));
      const cut = cutAt(event);
      const nearest = this.bars.length > 1 && Math.abs(cut - this.cuts[1]) < Math.abs(cut - this.cuts[0]) ? 1 : 0;
      // A picture that is seen whole cannot be moved: the nearest bar moves instead.
      dragged = bar >= 0 ? bar : this.zoom > this.fit ? -1 : nearest;
      this.host.setPointerCapture(event.pointerId);
      (dragged < 0 ? canvas : this.bars[dragged]).focus({ preventScroll: true });
      event.preventDefault();
      if (dragged >= 0) this.wipe(dragged, cut);
    });
    this.host.addEventListener("pointermove", (event) => {
      if (dragged === null) return;
      if (dragged >= 0) this.wipe(dragged, cutAt(event));
      else this.pan(event.movementX * devicePixelRatio, event.movementY * devicePixelRatio);
    });
    for (const end of ["pointerup", "pointercancel"])
      this.host.addEventListener(end, () => {
        dragged = null;
      });
    this.host.addEventListener(
      "wheel",
      (event) => {
        // In a page that scrolls, the wheel scrolls the page until the picture has the focus.
        const scrolls = document.documentElement.scrollHeight > innerHeight;
        if (scrolls && !event.ctrlKey && !this.host.contains(document.activeElement)) return;
        event.preventDefault();
        const { left, top } = canvas.getBoundingClientRect();
        const at = [event.clientX - left, event.clientY - top].map((length) => length * devicePixelRatio);
        this.zoomTo(this.scale * Math.exp(-event.deltaY / 400), at[0], at[1]);
      },
      { passive: false },
    );
    canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [64, 0], ArrowRight: [-64, 0], ArrowUp: [0, 64], ArrowDown: [0, -64] }[event.key];
      const zoom = { "+": this.scale * 1.25, "=": this.scale * 1.25, "-": this.scale / 1.25, 0: 0, 1: 1 }[event.key];
      if (event.ctrlKey || event.metaKey || (!way && zoom === undefined)) return;
      event.preventDefault();
      if (way) this.pan(way[0], way[1]);
      else this.zoomTo(/** @type {number} */ (zoom));
    });
  }
}
