/** The text of the scenario: an editor with completion, documentation and errors of the language. */

import { autocompletion, closeBrackets, completionKeymap, startCompletion } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, isolateHistory, redo, redoDepth, undo, undoDepth } from "@codemirror/commands";
import { yaml } from "@codemirror/lang-yaml";
import { HighlightStyle, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { lintGutter, setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { Annotation, EditorState, type Text as Lines } from "@codemirror/state";
import { drawSelection, EditorView, highlightActiveLine, hoverTooltip, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { useLayoutEffect, useRef } from "preact/hooks";
import type { Say } from "../live/player";
import { completions, documentation, type Schema } from "./language";
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
        [EditorState.tabSize.of(2), follow],
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
