/** Presses, drags and the wheel on the map; two fingers zoom the page, as everywhere. */

import { heard } from "../listening";
import type { Camera } from "./camera";
import type { Hand } from "./cursor";

type Place = [x: number, y: number];

/** A hand takes the drags whose press it accepts; others move the map, and a press without a drag is a click. */
export function listenToPointers(room: HTMLElement, camera: Camera, hand: () => Hand | undefined, clicked: (x: number, y: number) => void): () => void {
  let pressed: "hand" | "map" | null = null;
  let [before, travelled]: [Place, number] = [[0, 0], 0];
  const place = (event: MouseEvent): Place => {
    const box = room.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
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
    // On narrow screens the wheel scrolls the page; only a pinch zooms the map.
    const scrolls = document.documentElement.scrollHeight > innerHeight + 1;
    if (scrolls && !event.ctrlKey) return;
    event.preventDefault();
    camera.zoom(Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0015)), ...place(event));
  };
  const moves = { pointerdown: down, pointermove: move, pointerup: up, pointercancel: cancel, pointerleave: leave };
  const stops = [heard(room, moves), heard(room, { wheel }, { passive: false })];
  return () => stops.forEach((stop) => stop());
}
