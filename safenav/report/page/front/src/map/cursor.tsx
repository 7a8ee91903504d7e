/** The region under the pointer, or at the cursor of the arrow keys where a hand draws. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { heard } from "../panels/shell";
import { placeOf, regionAt, useRedraw } from "../run/run";
import { type Camera, CELL } from "./camera";
import { INK } from "./shapes";

/** Receiver of pointer events on the map; positions are columns and rows, with fractions. */
export interface Hand {
  /** A press; false leaves it to the map. */
  down(x: number, y: number): boolean;
  move(x: number, y: number): void;
  up(x: number, y: number): void;
  /** Cancel the gesture: a second finger zooms the page. */
  drop?(): void;
  /** The pointer is no longer over the map. */
  leave(): void;
  cursor: string;
  over: ComponentChildren;
}

const STEPS: Record<string, [dx: number, dy: number]> = {
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
};

type Place = [x: number, y: number];

function placeIn(room: HTMLElement, event: MouseEvent): Place {
  const box = room.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

interface CursorArgs {
  room: { current: HTMLElement | null };
  camera: Camera;
  cols: number;
  rows: number;
  /** The cursor starts here. */
  first: number;
  hand: Hand | undefined;
}

/** `pointed`: the region under the pointer or at the cursor, -1 if there is none. */
export function useCursor({ room, camera, cols, rows, first, hand }: CursorArgs) {
  const redraw = useRedraw();
  const pointer = useRef<Place | null>(null);
  const latest = useRef(-1); // quick keys come before the page is drawn again
  const at = latest.current;
  const under = (): number => (pointer.current === null ? -1 : regionAt({ cols, rows }, ...camera.at(...pointer.current)));
  const put = (region: number): void => {
    if (latest.current !== region) redraw();
    latest.current = region;
  };
  useLayoutEffect(() => {
    const moved = (event: PointerEvent | null): void => {
      const before = under();
      pointer.current = event && placeIn(room.current!, event);
      if (under() !== before) redraw();
      if (event) put(-1);
    };
    return heard(room.current!, { pointermove: (event: PointerEvent) => moved(event), pointerleave: () => moved(null) });
  }, [camera, cols, rows]);

  const keyed = (event: KeyboardEvent): void => {
    if (!hand || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = STEPS[event.key];
    if (!step && event.key !== "Enter") return;
    event.preventDefault();
    event.stopPropagation();
    if (latest.current < 0) return go(under() >= 0 ? under() : first);
    const [col, row] = placeOf({ cols }, latest.current);
    const middle = (x: number, y: number): [number, number] => [x + 0.5, y + 0.5];
    if (!step) {
      hand.down(...middle(col, row));
      hand.up(...middle(col, row));
      return;
    }
    const [x, y] = [col + step[0], row + step[1]];
    if (x < 0 || y < 0 || x >= cols || y >= rows) return;
    if (event.shiftKey && hand.down(...middle(col, row))) {
      hand.move(...middle(x, y));
      hand.up(...middle(x, y));
    }
    go(y * cols + x);
  };
  const go = (region: number): void => {
    const [col, row] = placeOf({ cols }, region);
    put(region);
    hand?.move(col + 0.5, row + 0.5);
    if (!camera.isWhole) camera.show(col, row);
  };
  const [col, row] = placeOf({ cols }, at);
  const mark = at >= 0 && <rect {...INK.cursor} x={col * CELL + 1} y={row * CELL + 1} width={CELL - 2} height={CELL - 2} />;
  return {
    pointed: at >= 0 ? at : under(),
    mark,
    keys: hand && {
      tabIndex: 0,
      role: "application" as const,
      onKeyDown: keyed,
      onFocus: () => room.current!.matches(":focus-visible") && at < 0 && go(first),
      onBlur: () => put(-1),
    },
  };
}

/** A hand takes the drags whose press it accepts; others move the map, and a press without a drag is a click. */
export function listenToPointers(room: HTMLElement, camera: Camera, hand: () => Hand | undefined, clicked: (x: number, y: number) => void): () => void {
  let pressed: "hand" | "map" | null = null;
  let [before, travelled]: [Place, number] = [[0, 0], 0];
  const place = (event: MouseEvent): Place => placeIn(room, event);
  const down = (event: PointerEvent): void => {
    if (event.button !== 0 || !event.isPrimary) return;
    [before, travelled] = [place(event), 0];
    pressed = hand()?.down(...camera.at(...before)) ? "hand" : "map";
    if (pressed === "map") return;
    room.setPointerCapture(event.pointerId);
    event.preventDefault();
  };
  const move = (event: PointerEvent): void => {
    if (!event.isPrimary) return;
    const now = place(event);
    hand()?.move(...camera.at(...now));
    if (pressed !== "map") return;
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    [before, travelled] = [now, travelled + Math.hypot(dx, dy)];
    if (travelled < 5 || camera.isWhole) return;
    room.setPointerCapture(event.pointerId);
    camera.pan(dx, dy);
  };
  const up = (event: PointerEvent): void => {
    if (!event.isPrimary) return;
    if (pressed === "hand") hand()?.up(...camera.at(...place(event)));
    else if (pressed === "map" && travelled < 5) clicked(...camera.at(...place(event)));
    pressed = null;
  };
  const cancel = (): void => {
    if (pressed === "hand") hand()?.drop?.();
    pressed = null;
  };
  const leave = (): void => {
    if (pressed !== "hand") hand()?.leave();
  };
  const wheel = (event: WheelEvent): void => {
    event.preventDefault();
    camera.zoom(Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0015)), ...place(event));
  };
  const moves = { pointerdown: down, pointermove: move, pointerup: up, pointercancel: cancel, pointerleave: leave };
  const stops = [heard(room, moves), heard(room, { wheel }, { passive: false })];
  return () => stops.forEach((stop) => stop());
}
