// Builds ../assets: page.js and page.css, the program and style of all pages, and its chunks: scene.js (three
// dimensions) and studio.js (live runs and the editor). They are committed, since who installs safenav has
// no Node. The first line of each names the sources it was built from, so that a test can tell
// without Node when a build was forgotten.
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const here = new URL(".", import.meta.url);
const sources = readdirSync(new URL("src/", here), { recursive: true, withFileTypes: true })
  .filter((entry) => entry.isFile())
  .map((entry) => `${entry.parentPath}/${entry.name}`.slice(here.pathname.length).replace("//", "/"))
  .sort();
const hash = createHash("sha256");
for (const name of [...sources, "build.mjs", "package-lock.json", "tsconfig.json"]) {
  hash.update(`${name}\n`).update(readFileSync(new URL(name, here)));
}
const stamp = `/* sources ${hash.digest("hex")} */`;

// A page carries its libraries to everybody who opens it, so it carries their licences too.
const licences = (...libraries) =>
  `/* ${libraries.map((name) => `Contains ${name}:\n${readFileSync(new URL(`node_modules/${name}/LICENSE`, here), "utf8").trim()}`).join("\n")} */\n`;

// The page has these modules for its chunks, which do not contain them a second time.
const shared = sources.filter((name) => /^src\/(app|(map|panels|run)\/.*)\.tsx?$/.test(name));
shared.push("preact", "preact/hooks", "preact/jsx-runtime");
const page = [
  ...shared.map((name, i) => `import * as m${i} from ${JSON.stringify(name.replace(/^src/, "./src"))};`),
  `globalThis.safenav = {${shared.map((name, i) => `${JSON.stringify(name)}: m${i}`)}};`,
  'import "./src/main";',
];
const borrowing = {
  name: "borrowing",
  setup(chunk) {
    chunk.onResolve({ filter: /./ }, async ({ path, pluginData, ...rest }) => {
      if (pluginData === "own" || rest.kind === "entry-point") return null;
      const found = path.startsWith(".") ? (await chunk.resolve(path, { ...rest, pluginData: "own" })).path.slice(here.pathname.length) : path;
      return shared.includes(found) ? { path: found, namespace: "page" } : null;
    });
    chunk.onLoad({ filter: /./, namespace: "page" }, ({ path }) => ({ contents: `module.exports = safenav[${JSON.stringify(path)}]` }));
  },
};

const PROGRAMS = [
  { name: "page", from: { stdin: { contents: page.join("\n"), resolveDir: here.pathname } }, notice: licences("preact") },
  { name: "scene", from: { entryPoints: ["src/view3d/stage.tsx"], globalName: "safenavScene", plugins: [borrowing] }, notice: licences("three") },
  { name: "studio", from: { entryPoints: ["src/studio/studio.tsx"], plugins: [borrowing] }, notice: licences("@codemirror/view", "@lezer/common") },
];

const check = process.argv.includes("--check");
for (const { name, from, notice } of PROGRAMS) {
  const result = await build({
    ...from,
    absWorkingDir: here.pathname,
    outfile: `${name}.js`,
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
  for (const { path, text } of result.outputFiles) {
    const file = path.split("/").pop();
    if (/<\/(script|style)/i.test(text)) throw new Error(`${file} would end its own element`);
    const target = new URL(`../assets/${file}`, here);
    const content = `${stamp}\n${file.endsWith(".js") ? notice : ""}${text}`;
    if (check && readFileSync(target, "utf8") !== content) {
      console.error(`${file} is not what the sources give: run npm run build`);
      process.exitCode = 1;
    } else if (!check) {
      mkdirSync(new URL(".", target), { recursive: true });
      writeFileSync(target, content);
      console.log(`${file}: ${(content.length / 1024).toFixed(1)} KiB`);
    }
  }
}
