/** A part of the page that opens over the map, which keeps its size. */

import type { ComponentChildren } from "preact";

export function Drawer({ name, kind, children }: { name: string; kind: string; children: ComponentChildren }) {
  return (
    <details class={`drawer ${kind}`} onKeyDown={(event) => event.key === "Escape" && (event.currentTarget.open = false)}>
      <summary>{name}</summary>
      <div class="inside">{children}</div>
    </details>
  );
}
