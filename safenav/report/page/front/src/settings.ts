/** The reader's choices: the theme and the contents of the map. */

import { useEffect, useState } from "preact/hooks";

export type Theme = "auto" | "light" | "dark";

export interface Shown {
  numbers: boolean;
  names: boolean;
  trails: boolean;
  targets: boolean;
  hidden: boolean;
  sight: boolean;
  beliefs: boolean;
  /** The robot whose sight and beliefs are shown: its index, or `EVERYONE`. */
  viewer: number;
}

export const EVERYONE = -1;

const KEY = "safenav-replay-theme";

/** The theme chosen earlier; pages opened from disk may have no storage. */
export function storedTheme(): Theme {
  try {
    const stored = localStorage.getItem(KEY);
    return stored === "light" || stored === "dark" ? stored : "auto";
  } catch {
    return "auto";
  }
}

const dark = matchMedia("(prefers-color-scheme: dark)");

/** Show a theme and remember it; "auto" follows that of the system. */
export function applyTheme(theme: Theme): void {
  const show = (): void => {
    document.documentElement.dataset.theme = theme === "auto" ? (dark.matches ? "dark" : "light") : theme;
  };
  dark.onchange = show;
  show();
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // The page works without storage.
  }
}

/** The theme after this one: auto, light, dark. */
export function nextTheme(theme: Theme): Theme {
  return theme === "auto" ? "light" : theme === "light" ? "dark" : "auto";
}

export const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** Return the size of the window, now and when it changes. */
export function useWindow(): [width: number, height: number] {
  const [size, setSize] = useState<[number, number]>([innerWidth, innerHeight]);
  useEffect(() => {
    const follow = (): void => setSize([innerWidth, innerHeight]);
    addEventListener("resize", follow);
    return () => removeEventListener("resize", follow);
  }, []);
  return size;
}

const low = matchMedia("(max-height: 760px)");

/** Return whether the window is so low that the page needs its compact layout. */
export function useLow(): boolean {
  const [is, setIs] = useState(low.matches);
  useEffect(() => {
    const follow = (): void => setIs(low.matches);
    low.addEventListener("change", follow);
    return () => low.removeEventListener("change", follow);
  }, []);
  return is;
}
