/** The text of the scenario: an editor with completion, documentation and errors of the language. */

import { autocompletion, closeBrackets, completionKeymap, startCompletion } from "@codemirror/autocomplete";
import { defaultKeymap } from "@codemirror/commands";
import { yaml } from "@codemirror/lang-yaml";
import { HighlightStyle, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { lintGutter, setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { Annotation, EditorState, type Text as Lines } from "@codemirror/state";
import { drawSelection, EditorView, highlightActiveLine, hoverTooltip, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { useEffect, useRef } from "preact/hooks";
import type { Say } from "../live/player";
import { completions, documentation, type Schema } from "./language";
import type { Problem } from "./model";

interface TextProps {
  text: string;
  problems: Problem[];
  say: Say;
  /** A line to scroll to; a new object scrolls again. */
  line: { number: number } | null;
}

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

export function Text({ text, problems, say, line }: TextProps) {
  const room = useRef<HTMLDivElement>(null);
  const view = useRef<EditorView | null>(null);
  const pending = useRef(0);
  const speak = useRef(say);
  speak.current = say;
  useEffect(() => {
    const changed = EditorView.updateListener.of((update) => {
      if (!update.docChanged || update.transactions.some((each) => each.annotation(told))) return;
      clearTimeout(pending.current);
      pending.current = window.setTimeout(() => {
        pending.current = 0;
        speak.current("text", { text: update.view.state.doc.toString() });
      }, CALM);
    });
    const history = (does: "undo" | "redo") => () => {
      speak.current(does);
      return true;
    };
    const made = (view.current = new EditorView({
      parent: room.current!,
      doc: text,
      extensions: [
        [lineNumbers(), lintGutter(), drawSelection(), highlightActiveLine(), closeBrackets(), indentUnit.of("  ")],
        [yaml(), syntaxHighlighting(colours)],
        autocompletion({ override: [async (context) => completions(await schema, context)] }),
        hoverTooltip(async (view, at) => documentation(await schema, view.state, at)),
        keymap.of([
          { key: "Mod-z", run: history("undo"), shift: history("redo") },
          { key: "Mod-y", run: history("redo") },
          { key: "Alt-Space", run: startCompletion },
          ...[...completionKeymap, ...defaultKeymap],
        ]),
        EditorView.contentAttributes.of({ "aria-label": "The scenario as YAML" }),
        [EditorState.tabSize.of(2), changed],
      ],
    }));
    return () => made.destroy();
  }, []);
  useEffect(() => {
    const { state } = view.current!;
    if (pending.current === 0) view.current!.dispatch({ changes: difference(state.doc.toString(), text), annotations: told.of(true) });
  }, [text]);
  useEffect(() => {
    if (pending.current !== 0) return; // problems of a text that has changed since
    const { state } = view.current!;
    view.current!.dispatch(setDiagnostics(state, problems.map((problem) => diagnosed(state.doc, problem))));
  }, [text, problems]);
  useEffect(() => {
    if (line === null) return;
    const { from, to } = lineAt(view.current!.state.doc, line.number);
    view.current!.dispatch({ selection: { anchor: from, head: to }, effects: EditorView.scrollIntoView(from, { y: "center" }) });
    view.current!.focus();
  }, [line]);
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
