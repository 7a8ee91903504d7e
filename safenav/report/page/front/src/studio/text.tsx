/** The text of the scenario, with line numbers, and problems at their lines. */

import { useEffect, useRef, useState } from "preact/hooks";
import type { Say } from "../live/player";
import type { Problem } from "./model";

interface TextProps {
  text: string;
  revision: number;
  problems: Problem[];
  say: Say;
  /** A line to scroll to; a new object scrolls again. */
  line: { number: number } | null;
}

const CALM = 200;

export function Text({ text, revision, problems, say, line }: TextProps) {
  const [own, setOwn] = useState(text);
  const area = useRef<HTMLTextAreaElement>(null);
  const gutter = useRef<HTMLPreElement>(null);
  const pending = useRef(0);
  /** Whether Tab indents: only after typing, else it moves the focus. */
  const typing = useRef(false);
  useEffect(() => {
    if (pending.current === 0) setOwn(text);
  }, [text, revision]);
  useEffect(() => {
    if (line === null || !area.current) return;
    const start = own.split("\n").slice(0, line.number - 1).join("\n").length + (line.number > 1 ? 1 : 0);
    area.current.focus();
    area.current.setSelectionRange(start, own.indexOf("\n", start) < 0 ? own.length : own.indexOf("\n", start));
    area.current.scrollTop = Math.max(0, (line.number - 6) * 18);
  }, [line]);
  const type = (value: string): void => {
    setOwn(value);
    clearTimeout(pending.current);
    pending.current = window.setTimeout(() => {
      pending.current = 0;
      say("text", { text: value });
    }, CALM);
  };
  const wrong = new Map(problems.map((problem) => [problem.line, problem]));
  const lines = own.split("\n").length;
  return (
    <div class="text">
      <pre class="gutter" ref={gutter} aria-hidden="true">
        {Array.from({ length: lines }, (_, i) => {
          const problem = wrong.get(i + 1);
          return (
            <span key={i} class={problem ? "wrong" : ""} title={problem?.found}>
              {i + 1}
              {"\n"}
            </span>
          );
        })}
      </pre>
      <textarea
        ref={area}
        spellcheck={false}
        wrap="off"
        aria-label="The scenario as YAML"
        value={own}
        onInput={(event) => type(event.currentTarget.value)}
        onScroll={(event) => (gutter.current!.scrollTop = event.currentTarget.scrollTop)}
        onPointerDown={() => (typing.current = true)}
        onBlur={() => (typing.current = false)}
        onKeyDown={(event) => {
          if (event.key !== "Tab") typing.current = event.key !== "Escape" && event.key !== "Shift";
          if (event.key !== "Tab" || event.shiftKey || !typing.current) return;
          event.preventDefault();
          const { selectionStart: a, selectionEnd: b } = event.currentTarget;
          type(`${own.slice(0, a)}  ${own.slice(b)}`);
        }}
      />
    </div>
  );
}
