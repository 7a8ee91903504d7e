/** Buttons, what they open, and short messages, which the toast of the studio shows. */

import type { ComponentChildren, JSX } from "preact";
import { useId } from "preact/hooks";
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

interface PopupProps {
  name: string;
  /** A class, for its place and form. */
  kind: string;
  children: ComponentChildren;
  /** Beside the name. */
  mark?: ComponentChildren;
  opened?(): void;
}

/** A button, and what it opens over the page; Esc, a press elsewhere, or a choice in it closes it. */
export function Popup({ name, kind, mark, opened, children }: PopupProps) {
  const id = useId();
  const chosen = (event: MouseEvent): void => {
    if ((event.target as HTMLElement).closest("button, a")) (event.currentTarget as HTMLElement).hidePopover();
  };
  return (
    <>
      <button type="button" popovertarget={id} data-opens={name}>
        {name}
        {mark}
      </button>
      <div id={id} popover="auto" class={`card popup ${kind}`} data-popup={name} onClick={chosen} onToggle={(event) => event.newState === "open" && opened?.()}>
        {children}
      </div>
    </>
  );
}
