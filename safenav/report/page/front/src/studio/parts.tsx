/** Text fields for the keys of a scenario without a control of their own, each with its errors. */

import { useEffect, useState } from "preact/hooks";
import type { Say } from "../live/player";
import type { Doc, Drawing, KeyAbout, Problem } from "./model";

interface PartsProps {
  doc: Doc;
  say: Say;
  /** The position of the keys: names of keys, and indices of list items. */
  path: (string | number)[];
  keys: KeyAbout[];
  /** The words on the button that adds a key. */
  add: string;
}

/** Fields of the present keys, and a menu of the others. */
export function Parts({ doc, say, path, keys, add }: PartsProps) {
  const [begun, begin] = useState<string[]>([]);
  const at = path.join("/");
  useEffect(() => begin([]), [at]);
  const found = doc.drawing?.parts[at] ?? {};
  const shown = keys.filter(({ key }) => key in found || begun.includes(key));
  const missing = keys.filter((one) => !shown.includes(one));
  return (
    <div class="parts">
      {shown.map(({ key, about }) => {
        return (
          <Part
            key={`${at}/${key}`}
            name={key}
            about={about}
            text={found[key]?.[0] ?? ""}
            fresh={!(key in found)}
            problems={doc.problems.filter((problem) => keyOf(found, problem) === key)}
            set={(value) => {
              say("edit", { op: "set_part", path, key, text: value });
              if (value.trim() === "") begin(begun.filter((other) => other !== key));
            }}
          />
        );
      })}
      {missing.length > 0 && (
        <select
          class="add-key"
          aria-label={add}
          value=""
          onChange={(event) => {
            begin([...begun, event.currentTarget.value]);
            event.currentTarget.value = "";
          }}
        >
          <option value="">{add}</option>
          {missing.map(({ key, about }) => (
            <option value={key} title={about}>
              {key}
            </option>
          ))}
        </select>
      )}
    </div>
  );
}

/** Return the key whose value has a problem: the last on its line that begins before it. */
function keyOf(parts: Drawing["parts"][string], { line, column }: Problem): string | undefined {
  const within = Object.entries(parts).filter(
    ([, [, first, from, last]]) => line <= last && (line > first || (line === first && column >= from)),
  );
  return within.sort(([, a], [, b]) => b[1] - a[1] || b[2] - a[2])[0]?.[0];
}

interface PartProps {
  name: string;
  about: string;
  text: string;
  /** Whether it was just added and has the focus. */
  fresh: boolean;
  problems: Problem[];
  set(text: string): void;
}

/** A field that sets its value on blur or Ctrl Enter and reverts on Escape. */
function Part({ name, about, text, fresh, problems, set }: PartProps) {
  const [own, setOwn] = useState(text);
  useEffect(() => setOwn(text), [text]);
  const tell = (): void => {
    if (own !== text) set(own);
  };
  const example = EXAMPLES[name];
  return (
    <div class="part" data-key={name}>
      <p>
        <b>{name}</b>
        {text !== "" && (
          <button type="button" aria-label={`Remove ${name}`} title={`Remove ${name}`} onClick={() => set("")}>
            ×
          </button>
        )}
      </p>
      <small class="quiet">{about}</small>
      <textarea
        aria-label={name}
        spellcheck={false}
        wrap="off"
        autofocus={fresh}
        rows={Math.min(8, Math.max(1, own.split("\n").length))}
        value={own}
        placeholder={example && `e.g. ${example}`}
        ref={(area) => {
          if (fresh && area && own === "" && document.activeElement?.matches(".add-key")) area.focus();
        }}
        onInput={(event) => setOwn(event.currentTarget.value)}
        onBlur={tell}
        onKeyDown={(event) => {
          if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) tell();
          else if (event.key === "Escape") setOwn(text);
          else return;
          event.preventDefault();
          event.stopPropagation();
        }}
      />
      {problems.map(({ found, hint }) => (
        <p class="wrong-part" key={found}>
          {found}
          {hint && <small>{hint}</small>}
        </p>
      ))}
    </div>
  );
}

/** The notation of the values of some keys. */
const EXAMPLES: Record<string, string> = {
  areas: "{store: {rows: 1-2, columns: 1-3}}",
  inputs: "{alarm: {at: [10-20]}}",
  never_together: "[{robots: [a, b], in: [47]}]",
  changes: "[{at: 12, robot: a, service: out}]",
  until: "{rounds: 2, by: 200}",
  resolve_within: "30",
  suspects: "[{type: door, region: 47}]",
  late: "stop",
  chargers: "[14]",
  flat: "flat_battery",
  limits: "{ticks: 500, seconds: 60}",
  clock: "live",
  failures: "{retries: 2}",
  partition: "rooms",
  requirements: "[always(distance(a, b) >= 0.5)]",
  expect: "{outcome: completed}",
  vision: "4",
  avoids: "[b]",
  tracks: "[b]",
  tracking: "belief",
  within: "40",
  avoid: "[28, store]",
  always: "region = 16 -> region' != 17",
  battery: "{capacity: 60, charge: 5}",
  carries: "2",
  capabilities: "[push, lift]",
  timing: "2",
  needs: "[{action: lift, at: [47]}, {action: lift, at: [14], same: true}]",
  resolve_at: "neighbours",
  blocks: "[ground]",
};
