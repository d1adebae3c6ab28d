// Builds viewer.html, the page that replays are put into: `npm ci && npm run build`.
// Its first line holds the hash of everything it is made from; a test compares it.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const folder = dirname(fileURLToPath(import.meta.url));
const read = (...path) => readFileSync(join(folder, ...path), "utf8");

function sourceHash() {
  const sources = readdirSync(join(folder, "src")).map((name) => `src/${name}`);
  const hash = createHash("sha256");
  for (const name of [...sources, "build.mjs", "package.json", "package-lock.json"].sort()) {
    hash.update(`${name}\0${read(name)}\0`);
  }
  return hash.digest("hex");
}

const bundle = await build({
  entryPoints: [join(folder, "src", "main.js")],
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  target: "es2022",
  legalComments: "none",
});
const script = bundle.outputFiles[0].text.replaceAll("</script", "<\\/script").trim();
const style = (await build({
  entryPoints: [join(folder, "src", "style.css")],
  minify: true,
  write: false,
})).outputFiles[0].text.trim();
const version = JSON.parse(read("node_modules", "three", "package.json")).version;
const licence = read("node_modules", "three", "LICENSE").trim();
const banner = `<!-- built by rigid_envs/watch/replays/viewer/build.mjs from sources ${sourceHash()} -->`;
const page = read("src", "page.html")
  .replace("<!-- banner -->", () => `${banner}\n<!-- contains three.js ${version}:\n\n${licence}\n-->`)
  .replace("/* style */", () => style)
  .replace("/* script */", () => script);
writeFileSync(join(folder, "viewer.html"), page);
writeFileSync(join(folder, "THREE-LICENSE.txt"), `three.js ${version}, part of viewer.html\n\n${licence}\n`);
console.log(`viewer.html: ${Math.round(page.length / 1024)} kB`);
