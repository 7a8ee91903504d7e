/** Colours of the page's theme, for materials: the stylesheet has them once. */

import { Color } from "three";

export type Role = "page" | "accent" | "ground" | "grid" | "wall" | "ink" | "hidden" | "found" | "requested" | "resolved" | "blocked" | "number";

export function themeColour(role: Role): Color {
  return new Color(getComputedStyle(document.documentElement).getPropertyValue(`--${role}`).trim());
}
