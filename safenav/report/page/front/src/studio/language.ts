/** The language of scenarios in the editor: its JSON Schema at a place of the text. */

import type { Completion, CompletionContext, CompletionResult } from "@codemirror/autocomplete";
import type { EditorState } from "@codemirror/state";
import type { Tooltip } from "@codemirror/view";

export interface Schema {
  description?: string;
  enum?: unknown[];
  const?: unknown;
  $ref?: string;
  properties?: Record<string, Schema>;
  additionalProperties?: Schema | boolean;
  items?: Schema | boolean;
  anyOf?: Schema[];
  $defs?: Record<string, Schema>;
}

type Step = string | number;

/** All forms that a value may have: references and alternatives resolved. */
function formsOf(root: Schema, schema: Schema | boolean | undefined): Schema[] {
  if (typeof schema !== "object") return [];
  const named = schema.$ref ? formsOf(root, root.$defs![schema.$ref.split("/").pop()!]) : [];
  return [schema, ...named, ...(schema.anyOf ?? []).flatMap((form) => formsOf(root, form))];
}

function below(root: Schema, path: Step[]): Schema[] {
  let forms = formsOf(root, root);
  for (const step of path) {
    forms = forms.flatMap((form) => {
      if (typeof step === "number") return formsOf(root, form.items);
      return formsOf(root, form.properties?.[step] ?? form.additionalProperties);
    });
  }
  return forms;
}

function keysOf(forms: Schema[]): Map<string, Schema> {
  return new Map(forms.flatMap((form) => Object.entries(form.properties ?? {})));
}

/** The documentation of a key: its own words, else those of its form. */
function wordsOf(root: Schema, schema: Schema): string {
  return formsOf(root, schema).find((form) => form.description)?.description ?? "";
}

/** The path by indentation: a line that is being written has no node of its own yet. */
function indented(state: EditorState, at: number): Step[] {
  const line = state.doc.lineAt(at);
  let indent = line.text.search(/[^ ]|$/);
  const path: Step[] = [];
  const dash = /^ *- +/.exec(line.text);
  if (dash) path.unshift(0);
  for (let number = line.number - 1; number > 0 && (indent > 0 || dash); number--) {
    const { text } = state.doc.line(number);
    const found = /^( *)(- +)?(?:([\w@-]+) *:)?/.exec(text)!;
    const depth = found[1]!.length;
    if (text.trim() === "" || text.trim().startsWith("#") || depth > indent) continue;
    if (depth === indent && !(dash && path.length === 1 && found[3] && !found[2])) continue;
    if (found[3] && !(found[2] && depth + found[2].length >= indent)) path.unshift(found[3]);
    if (found[2]) path.unshift(0);
    indent = depth;
    if (indent === 0 && !found[2]) break;
  }
  return path;
}

/** The innermost bracket that is open before a place: the text from it on, and the keys that lead there. */
function inBrackets(state: EditorState, at: number): { path: Step[]; rest: string } | null {
  const text = state.sliceDoc(0, at);
  let open: { key: Step; from: number }[] = [];
  for (const { index, 0: found } of text.matchAll(/#.*|^(?=\w)|[[\]{}]/gm)) {
    if (found === "") open = []; // a key of the scenario
    else if (found === "{" || found === "[") {
      const key = /([\w@-]+) *: *$/.exec(state.sliceDoc(state.doc.lineAt(index).from, index));
      open.push({ key: key ? key[1]! : 0, from: index + 1 });
    } else if (found === "}" || found === "]") open.pop();
  }
  if (open.length === 0) return null;
  const first = state.doc.lineAt(open[0]!.from);
  const { from } = open[open.length - 1]!;
  const within = open.map(({ key }) => key);
  if (/^ *- *[{[]/.test(first.text) && within[0] === 0) within.shift();
  const list = text[from - 1] === "[";
  return { path: [...indented(state, first.from), ...within, ...(list ? [0] : [])], rest: text.slice(from) };
}

/** Offer the keys that a mapping may have at the cursor, or the values of its key. */
export function completions(root: Schema | null, context: CompletionContext): CompletionResult | null {
  const { state, pos } = context;
  if (root === null) return null;
  const flow = inBrackets(state, pos);
  const path = flow?.path ?? indented(state, pos);
  const written = (flow?.rest ?? state.sliceDoc(state.doc.lineAt(pos).from, pos)).replace(/^ *- +/, "");
  const value = /([\w@-]+) *: *([\w-]*)$/.exec(written);
  const word = context.matchBefore(/[\w-]*/)!;
  if (word.from === word.to && !context.explicit) return null;
  const forms = below(root, value ? [...path, value[1]!] : path);
  const values = forms.flatMap((form) => form.enum ?? (form.const === undefined ? [] : [form.const]));
  const options: Completion[] = value
    ? values.map((each) => ({ label: String(each), type: "enum" }))
    : [...keysOf(forms)].map(([label, schema]) => ({ label, apply: `${label}: `, type: "property", info: wordsOf(root, schema) }));
  return options.length ? { from: word.from, options, validFor: /^[\w-]*$/ } : null;
}

/** The documentation of the key under the pointer. */
export function documentation(root: Schema | null, state: EditorState, at: number): Tooltip | null {
  const line = state.doc.lineAt(at);
  const keys = [...line.text.replace(/#.*/, "").matchAll(/[\w@-]+(?= *:)/g)];
  const found = keys.find((key) => line.from + key.index <= at && at <= line.from + key.index + key[0].length);
  if (root === null || found === undefined) return null;
  const [pos, key] = [line.from + found.index, found[0]];
  const path = inBrackets(state, pos)?.path ?? indented(state, pos);
  const words = below(root, path).flatMap((form) => (form.properties?.[key] ? [wordsOf(root, form.properties[key])] : []))[0];
  if (!words) return null;
  const create = () => {
    const dom = document.createElement("div");
    dom.className = "cm-documentation";
    dom.textContent = words;
    return { dom };
  };
  return { pos, end: pos + key.length, above: true, create };
}
