/** The language of scenarios in the editor: its JSON Schema at a place of the text. */

import type { Completion, CompletionContext, CompletionResult } from "@codemirror/autocomplete";
import { ensureSyntaxTree } from "@codemirror/language";
import type { EditorState } from "@codemirror/state";
import type { Tooltip } from "@codemirror/view";
import type { SyntaxNode } from "@lezer/common";

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

const PAIR = new Set(["Pair", "FlowPair"]);

/** The keys and indices that lead to a node of the text. */
function pathOf(state: EditorState, node: SyntaxNode | null): Step[] {
  const path: Step[] = [];
  for (let at = node; at !== null; at = at.parent) {
    if (PAIR.has(at.name)) {
      const key = at.getChild("Key");
      if (key !== null) path.unshift(state.sliceDoc(key.from, key.to).replace(/^["']|["']$/g, ""));
    } else if (at.name === "Item") path.unshift(0);
    else if (at.parent?.name === "FlowSequence" && !/[[\],]/.test(at.name)) path.unshift(0);
  }
  return path;
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

/** The innermost bracket that is open before a place on its line: the text from it on, and the keys before it. */
function inBrackets(state: EditorState, at: number): { path: Step[]; rest: string } | null {
  const before = state.sliceDoc(state.doc.lineAt(at).from, at);
  const open: { key: Step | null; from: number }[] = [];
  for (let i = 0; i < before.length; i++) {
    if (before[i] === "{" || before[i] === "[") {
      const key = /([\w@-]+) *: *$/.exec(before.slice(0, i));
      open.push({ key: key ? key[1]! : 0, from: i + 1 });
    } else if (before[i] === "}" || before[i] === "]") open.pop();
  }
  const last = open.pop();
  if (last === undefined) return null;
  const outer = indented(state, at);
  const within = [...open, last].map(({ key }) => key!);
  if (/^ *- *[{[]/.test(before) && within[0] === 0) within.shift();
  const list = before[last.from - 1] === "[";
  return { path: [...outer, ...within, ...(list ? [0] : [])], rest: before.slice(last.from) };
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
  const tree = ensureSyntaxTree(state, state.doc.length, 200);
  if (root === null || tree === null) return null;
  let node: SyntaxNode | null = tree.resolveInner(at, 1);
  while (node !== null && node.name !== "Key") node = node.parent;
  if (node === null) return null;
  const path = pathOf(state, node.parent);
  const found = below(root, path.slice(0, -1)).map((form) => form.properties?.[String(path[path.length - 1])]);
  const words = found.filter((schema) => schema !== undefined).map((schema) => wordsOf(root, schema))[0];
  if (!words) return null;
  const { from, to } = node;
  const create = () => {
    const dom = document.createElement("div");
    dom.className = "cm-documentation";
    dom.textContent = words;
    return { dom };
  };
  return { pos: from, end: to, above: true, create };
}
