/** Menus of the studio: Esc, or a choice, closes an open one. */

import type { ComponentChildren } from "preact";
import { heard } from "../listening";
import { useLayoutEffect, useRef } from "preact/hooks";

interface MenuProps {
  title: string;
  children: ComponentChildren;
  mark?: ComponentChildren;
  opened?(): void;
}

export function Menu({ title, children, mark, opened }: MenuProps) {
  const menu = useRef<HTMLDetailsElement>(null);
  const chosen = (event: Event): void => {
    if ((event.target as HTMLElement).closest("button, a")) menu.current!.open = false;
  };
  return (
    <details class="menu" ref={menu} data-menu={title} onToggle={() => menu.current!.open && opened?.()}>
      <summary class="card">
        {title}
        {mark}
      </summary>
      <div class="card" onClick={chosen}>{children}</div>
    </details>
  );
}

/** Close open menus on Esc, which then has no other effect, and on a press elsewhere. */
export function useClosingMenus(): void {
  useLayoutEffect(() => {
    const open = (): HTMLDetailsElement[] => [...document.querySelectorAll<HTMLDetailsElement>("details.menu[open]")];
    const pressed = (event: Event): void => {
      for (const menu of open()) if (!menu.contains(event.target as Node)) menu.open = false;
    };
    const keyed = (event: KeyboardEvent): void => {
      const menus = open();
      if (event.key !== "Escape" || menus.length === 0) return;
      for (const menu of menus) menu.open = false;
      menus[0]!.querySelector("summary")!.focus();
      event.preventDefault();
      event.stopImmediatePropagation();
    };
    const stops = [heard(window, { pointerdown: pressed }, { capture: true }), heard(window, { keydown: keyed }, { capture: true })];
    return () => stops.forEach((stop) => stop());
  }, []);
}
