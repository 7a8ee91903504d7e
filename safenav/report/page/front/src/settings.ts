/** The reader's choices: the theme and the contents of the map. */

export type Theme = "auto" | "light" | "dark";

/** All contents of the map; `viewer` is the robot whose sight and beliefs are shown: its index, or `EVERYONE`. */
export const ALL = { numbers: true, names: true, trails: true, targets: true, hidden: true, sight: true, beliefs: true, viewer: -1 };
export type Shown = typeof ALL;

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
