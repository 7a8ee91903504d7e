// Builds the pages: ../assets/replay.*, ../../view3d/assets/view3d.* and
// ../../../studio/assets/studio.*. They are committed, since who installs safenav has
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
const licence = (library) => readFileSync(new URL(`node_modules/${library}/LICENSE`, here), "utf8").trim();
const preact = `Contains Preact:\n${licence("preact")}`;
const editor = ["@codemirror/view", "@lezer/common"].map((name) => `Contains ${name.split("/")[0]} libraries:\n${licence(name)}`).join("\n");
const three = `Contains three.js:\n${licence("three")}`;

/** Each page: where it starts, where its files go, and what they contain by others. */
const PAGES = [
  { name: "replay", entry: "src/main.tsx", assets: "../assets/", notice: `/* ${preact} */\n` },
  { name: "view3d", entry: "src/main3d.tsx", assets: "../../view3d/assets/", notice: `/* ${preact}\n${three} */\n` },
  { name: "studio", entry: "src/studio/main.tsx", assets: "../../../studio/assets/", notice: `/* ${preact}\n${editor} */\n` },
];

const check = process.argv.includes("--check");
for (const page of PAGES) {
  const result = await build({
    absWorkingDir: here.pathname,
    entryPoints: [page.entry],
    outfile: `${page.name}.js`,
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
    const name = path.split("/").pop();
    if (/<\/(script|style)/i.test(text)) throw new Error(`${name} would end its own element`);
    const target = new URL(page.assets + name, here);
    const content = `${stamp}\n${name.endsWith(".js") ? page.notice : ""}${text}`;
    if (check && readFileSync(target, "utf8") !== content) {
      console.error(`${name} is not what the sources give: run npm run build`);
      process.exitCode = 1;
    } else if (!check) {
      mkdirSync(new URL(".", target), { recursive: true });
      writeFileSync(target, content);
      console.log(`${name}: ${(content.length / 1024).toFixed(1)} KiB`);
    }
  }
}
