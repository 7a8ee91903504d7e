/** The help of a page: its keys, each once, and more below. */

import type { ComponentChildren } from "preact";

export type Keys = [keys: string, meaning: string][];

interface HelpProps {
  dialog: { current: HTMLDialogElement | null };
  keys: Keys;
  children?: ComponentChildren;
}

export function Help({ dialog, keys, children }: HelpProps) {
  return (
    <dialog
      ref={dialog}
      aria-labelledby="help-title"
      onClick={(event) => event.target === event.currentTarget && dialog.current!.close()}
    >
      <div>
        <h2 id="help-title">Keys</h2>
        <dl>
          {keys.map(([names, meaning]) => (
            <div key={names}>
              <dt>
                {names.split(" ").map((key) => (
                  <kbd key={key}>{key}</kbd>
                ))}
              </dt>
              <dd>{meaning}</dd>
            </div>
          ))}
        </dl>
        {children}
        <form method="dialog">
          <button>Close</button>
        </form>
      </div>
    </dialog>
  );
}

/** The keys of a page that replaces some of the usual ones. */
export function withKeys(keys: Keys, own: Keys): Keys {
  const mine = new Map(own);
  const kept = keys.map(([names, meaning]): Keys[number] => [names, mine.get(names) ?? meaning]);
  return [...kept, ...own.filter(([names]) => !keys.some(([other]) => other === names))];
}
