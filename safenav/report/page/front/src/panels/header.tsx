/** The top of each page, with the theme, and the help, which shows its keys and more. */

import type { ComponentChildren } from "preact";
import { useMemo, useRef, useState } from "preact/hooks";
import { Button, Press } from "./button";
import { applyTheme, nextTheme, storedTheme } from "../settings";

export type Keys = [keys: string, meaning: string][];

/** The theme and the help of a page; its keys change them too. */
export function useShell() {
  const [theme, setTheme] = useState(storedTheme);
  const dialog = useRef<HTMLDialogElement>(null);
  useMemo(() => applyTheme(theme), [theme]); // before a scene takes its colours from the page
  return { theme, dialog, turn: () => setTheme(nextTheme), help: () => dialog.current!.showModal() };
}

interface HeaderProps {
  shell: ReturnType<typeof useShell>;
  name: string;
  state: ComponentChildren;
  keys: Keys;
  /** In the help, below the keys. */
  about: ComponentChildren;
  children: ComponentChildren;
}

export function Header({ shell, name, state, keys, about, children }: HeaderProps) {
  const { theme, dialog, turn, help } = shell;
  return (
    <>
      <header>
        <div>
          <h1>{name}</h1>
          {state}
        </div>
        <div class="group row">
          {children}
          <Button icon={theme} label={`Theme: ${theme}`} act={turn} />
          <Press title="Help" aria-label="Help" act={help}>
            ?
          </Press>
        </div>
      </header>
      <dialog class="card" ref={dialog} aria-labelledby="help-title" onClick={(event) => event.target === event.currentTarget && dialog.current!.close()}>
          <h2 id="help-title">Keys</h2>
          <dl>
            {keys.map(([names, meaning]) => (
              <div key={names}>
                <dt>
                  {names.split(" ").map((key) => (
                    <span key={key}>
                      <kbd>{key}</kbd>{" "}
                    </span>
                  ))}
                </dt>
                <dd>{meaning}</dd>
              </div>
            ))}
          </dl>
          {about}
          <form method="dialog">
            <button>Close</button>
          </form>
      </dialog>
    </>
  );
}

/** The keys of a page that replaces some of the usual ones. */
export function withKeys(keys: Keys, own: Keys): Keys {
  return [...new Map([...keys, ...own])];
}
