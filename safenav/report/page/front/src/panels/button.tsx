/** Buttons, drawers, and short messages, which the toast of the studio shows. */

import type { ComponentChildren, JSX } from "preact";
import { heard } from "../listening";
import { Icon, type ButtonIcon } from "./icons";

const NAME = "safenav-notice";

export function notice(words: string): void {
  dispatchEvent(new CustomEvent(NAME, { detail: words }));
}

export function onNotice(show: (words: string) => void): () => void {
  return heard(window, { [NAME]: (event: CustomEvent<string>) => show(event.detail) });
}

interface PressProps extends Omit<JSX.IntrinsicElements["button"], "action"> {
  act(): void;
  /** Reason why it is disabled: then it only shows this advice. */
  off?: string | false | undefined;
}

export function Press({ act, off, title, ...rest }: PressProps) {
  const effect = off ? { "aria-disabled": true, title: off, onClick: () => notice(off) } : { title, onClick: act };
  return <button type="button" {...rest} {...effect} />;
}

interface ButtonProps extends Pick<PressProps, "act" | "off"> {
  icon: ButtonIcon;
  label: string;
  primary?: boolean;
}

/** A button with a drawing. */
export function Button({ icon, label, primary, ...does }: ButtonProps) {
  return (
    <Press class={primary ? "primary" : ""} aria-label={label} title={label} {...does}>
      <Icon name={icon} />
    </Press>
  );
}

/** A part of the page that opens over the map, which keeps its size. */
export function Drawer({ name, kind, children }: { name: string; kind: string; children: ComponentChildren }) {
  return (
    <details class={`drawer ${kind}`} onKeyDown={(event) => event.key === "Escape" && (event.currentTarget.open = false)}>
      <summary class="card">{name}</summary>
      <div class="inside card">{children}</div>
    </details>
  );
}
