// The library that the page ships, from npm into the page's folder, with a NOTICE of its version, hashes and licence.

import { createHash } from "node:crypto";
import { copyFileSync, readFileSync, writeFileSync } from "node:fs";

const [from, to] = process.argv.slice(2);
const names = ["uPlot.esm.js", "uPlot.d.ts", "uPlot.min.css"];
const packaged = JSON.parse(readFileSync(`${from}/package.json`, "utf8"));
const lines = names.map((name) => {
  // The types are called after the module that they describe.
  const shipped = name.replace(/^uPlot.d.ts$/, "uPlot.esm.d.ts");
  copyFileSync(`${from}/dist/${name}`, `${to}/${shipped}`);
  return `${createHash("sha256").update(readFileSync(`${to}/${shipped}`)).digest("hex")}  ${shipped}`;
});
writeFileSync(
  `${to}/NOTICE`,
  `uPlot ${packaged.version}, ${packaged.license}, from npm's package uplot; unchanged. make vendor fetches it anew.

Why uPlot: one module of ${Math.round(readFileSync(`${to}/uPlot.esm.js`).length / 1000)} kB without dependencies, MIT. It gives axes, logarithmic scales and hooks to draw bands on
a canvas, which follows a slider. It writes no style element, so that the page's
content security policy needs no exception, as Observable Plot (SVG with style elements, and d3 beside it) and
Vega-Lite (evaluates code, and is several times the size) would.

SHA-256:
${lines.join("\n")}

${readFileSync(`${from}/LICENSE`, "utf8").trim()}
`,
);
