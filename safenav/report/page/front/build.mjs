// Builds ../assets/replay.js and replay.css. They are committed, since who installs safenav has
// no Node. The first line of each names the sources it was built from, so that a test can tell
// without Node when a build was forgotten.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const here = new URL(".", import.meta.url);
const sources = readdirSync(new URL("src/", here)).sort().map((name) => `src/${name}`);
const hash = createHash("sha256");
for (const name of [...sources, "build.mjs", "package-lock.json", "tsconfig.json"]) {
  hash.update(`${name}\n`).update(readFileSync(new URL(name, here)));
}
const stamp = `/* sources ${hash.digest("hex")} */`;

// The page carries Preact to whoever opens it, so it carries Preact's licence too.
const licence = readFileSync(new URL("node_modules/preact/LICENSE", here), "utf8").trim();
const notice = { "replay.js": `/* Contains Preact:\n${licence} */\n`, "replay.css": "" };

const result = await build({
  absWorkingDir: here.pathname,
  entryPoints: ["src/main.tsx"],
  outfile: "replay.js",
  bundle: true,
  minify: true,
  format: "iife",
  target: ["es2022"],
  charset: "utf8",
  legalComments: "none",
  jsx: "automatic",
  jsxImportSource: "preact",
  write: false,
});
const check = process.argv.includes("--check");
for (const { path, text } of result.outputFiles) {
  const name = path.split("/").pop();
  if (/<\/(script|style)/i.test(text)) throw new Error(`${name} would end its own element`);
  const target = new URL(`../assets/${name}`, here);
  const content = `${stamp}\n${notice[name]}${text}`;
  if (check && readFileSync(target, "utf8") !== content) {
    console.error(`${name} is not what the sources give: run npm run build`);
    process.exitCode = 1;
  } else if (!check) {
    writeFileSync(target, content);
    console.log(`${name}: ${(content.length / 1024).toFixed(1)} KiB`);
  }
}
