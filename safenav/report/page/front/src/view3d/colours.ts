/** Colours of the page's theme, for materials: the stylesheet has both of each, `light-dark(#…, #…)`. */

import { Color } from "three";

export type Role = "page" | "accent" | "ground" | "grid" | "wall" | "ink" | "hidden" | "found" | "requested" | "resolved" | "blocked" | "number";

export function themeColour(role: Role): Color {
  const root = document.documentElement;
  const [light, dark] = getComputedStyle(root).getPropertyValue(`--${role}`).match(/#\w+/g)!;
  return new Color(root.dataset.theme === "dark" ? dark : light);
}
