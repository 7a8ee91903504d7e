/** The text of the scenario: an editor with completion, documentation and errors of the language. */

import { autocompletion, closeBrackets, type Completion, type CompletionContext, completionKeymap, type CompletionResult, startCompletion } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, isolateHistory, redo, redoDepth, undo, undoDepth } from "@codemirror/commands";
import { yaml } from "@codemirror/lang-yaml";
import { HighlightStyle, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { type Diagnostic, lintGutter, setDiagnostics } from "@codemirror/lint";
import { Annotation, EditorState, type Text as Lines } from "@codemirror/state";
import { drawSelection, EditorView, highlightActiveLine, hoverTooltip, keymap, lineNumbers, type Tooltip } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { useLayoutEffect, useRef } from "preact/hooks";
import type { Say } from "../live/player";
import { dark } from "../run/run";
import type { Problem } from "./model";

/** Milliseconds after the last key until the studio reads the text. */
const CALM = 120;
/** Marks a change that came from the studio. */
const told = Annotation.define<boolean>();

const colours = HighlightStyle.define([
  { tag: tags.comment, color: "var(--quiet)", fontStyle: "italic" },
  { tag: [tags.propertyName, tags.definition(tags.propertyName)], color: "var(--accent)" },
  { tag: tags.string, color: "var(--resolved)" },
  { tag: [tags.punctuation, tags.separator, tags.squareBracket, tags.brace], color: "var(--quiet)" },
]);

/** The language of scenarios; without it the editor still writes. */
const schema: Promise<Schema | null> = fetch("schema.json").then(
  (answer) => answer.json() as Promise<Schema>,
  () => null,
);

/** The text with its history, which stays while a run is shown. */
export class Writing {
  readonly view: EditorView;
  private pending = 0;

  /** `changed` is called after each change. */
  constructor(text: string, say: Say, changed: () => void) {
    const follow = EditorView.updateListener.of((update) => {
      if (!update.docChanged) return;
      changed();
      if (update.transactions.some((each) => each.annotation(told))) return;
      clearTimeout(this.pending);
      this.pending = window.setTimeout(() => {
        this.pending = 0;
        say("text", { text: update.view.state.doc.toString() });
      }, CALM);
    });
    this.view = new EditorView({
      doc: text,
      extensions: [
        [lineNumbers(), lintGutter(), drawSelection(), highlightActiveLine(), closeBrackets(), indentUnit.of("  ")],
        [yaml(), syntaxHighlighting(colours), history()],
        autocompletion({ override: [async (context) => completions(await schema, context)] }),
        hoverTooltip(async (view, at) => documentation(await schema, view.state, at)),
        keymap.of([{ key: "Alt-Space", run: startCompletion }, ...historyKeymap, ...completionKeymap, ...defaultKeymap]),
        EditorView.contentAttributes.of({ "aria-label": "The scenario as YAML" }),
        [EditorState.tabSize.of(2), EditorView.darkTheme.of(dark.matches), follow],
      ],
    });
  }

  get undoable(): boolean {
    return undoDepth(this.view.state) > 0;
  }

  get redoable(): boolean {
    return redoDepth(this.view.state) > 0;
  }

  undo = (): boolean => undo(this.view);
  redo = (): boolean => redo(this.view);

  /** Take the text of the studio and its problems, unless the reader has written since. */
  show(text: string, problems: Problem[]): void {
    if (this.pending !== 0) return;
    const { doc } = this.view.state;
    const annotations = [told.of(true), isolateHistory.of("full")];
    if (doc.toString() !== text) this.view.dispatch({ changes: difference(doc.toString(), text), annotations });
    this.view.dispatch(setDiagnostics(this.view.state, problems.map((problem) => diagnosed(this.view.state.doc, problem))));
  }

  /** Go to a line. */
  go(number: number): void {
    const { from, to } = lineAt(this.view.state.doc, number);
    this.view.dispatch({ selection: { anchor: from, head: to }, effects: EditorView.scrollIntoView(from, { y: "center" }) });
    this.view.focus();
  }
}

export function Text({ writing, text, problems }: { writing: Writing; text: string; problems: Problem[] }) {
  const room = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => room.current!.append(writing.view.dom), [writing]);
  useLayoutEffect(() => writing.show(text, problems), [text, problems]);
  return <div class="text" ref={room} />;
}

function lineAt(doc: Lines, number: number) {
  return doc.line(Math.max(1, Math.min(doc.lines, number)));
}

function diagnosed(doc: Lines, { line, column, found, hint }: Problem): Diagnostic {
  const { from, to } = lineAt(doc, line);
  const at = Math.min(to, from + Math.max(0, column - 1));
  return { from: at, to, severity: "error", message: hint ? `${found}\n${hint}` : found };
}

/** The smallest change from one text to another, so that the cursor stays where it is. */
function difference(before: string, after: string): { from: number; to: number; insert: string } {
  let from = 0;
  while (from < before.length && from < after.length && before[from] === after[from]) from++;
  let same = 0;
  const most = Math.min(before.length, after.length) - from;
  while (same < most && before[before.length - 1 - same] === after[after.length - 1 - same]) same++;
  return { from, to: before.length - same, insert: after.slice(from, after.length - same) };
}

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
