/** Bodies that stay on the ground; those that drive, and how those of known models look. */

import { CylinderGeometry, Group, type Material, type Mesh } from "three";
import type { Sample } from "./motion";
import { DARK, GLASS, axles, box, paint, rod, shade, solid, upright, type Body } from "./solids";

/** A body that moves over the ground as it faces. */
export abstract class Grounded implements Body {
  readonly group = new Group();
  abstract readonly top: number;
  abstract readonly hold: [number, number];
  abstract readonly room: number;
  private previous: [x: number, y: number] | null = null;
  private gone = 0;

  pose({ x, y, z = 0, yaw = 0 }: Sample): void {
    const passed = this.previous === null ? 0 : Math.hypot(x! - this.previous[0], y! - this.previous[1]);
    this.previous = [x!, y!];
    this.gone += passed;
    this.group.position.set(x!, y!, Math.max(0, z - 0.14));
    this.group.rotation.z = yaw;
    this.move(this.gone, passed > 1e-5);
  }

  /** Move its parts after a way in metres. */
  protected move(_gone: number, _moves: boolean): void {}
}

type Builder = (skin: Material, dark: Material) => Mesh[];

/** A body that drives: what the builder makes, and wheels that roll. x is ahead, z up, in metres. */
export class Vehicle extends Grounded {
  readonly top: number;
  readonly hold: [number, number];
  readonly room: number;
  private readonly radius: number;
  private readonly wheels: Mesh[];

  constructor(scale: number, colour: string, build: Builder, radius: number, places: [x: number, y: number][], [ahead, up, room]: [number, number, number]) {
    super();
    this.radius = radius * scale;
    [this.hold, this.room] = [[ahead * scale, up * scale], room * scale];
    const inner = new Group();
    const parts = build(paint(colour), paint(DARK));
    for (const { geometry } of parts) geometry.computeBoundingBox();
    this.top = Math.max(...parts.map(({ position, geometry }) => position.z + geometry.boundingBox!.max.z)) * scale + 0.3;
    this.wheels = places.map(([x, y]) => solid(new CylinderGeometry(radius, radius, radius * 0.6, 14), paint(DARK), x, y, radius));
    inner.add(...parts, ...this.wheels);
    inner.scale.setScalar(scale);
    this.group.add(inner, shade(0.3 * scale + 0.1));
  }

  protected override move(gone: number): void {
    for (const wheel of this.wheels) wheel.rotation.y = gone / this.radius;
  }
}

/** A low chassis between four wheels, with a raised deck. */
export function buggy(length: number, width: number, height: number, wheel: number): Builder {
  return (skin, dark) => [
    box(length, width * 0.58, height * 0.5, skin, 0, 0, wheel + height * 0.2),
    box(length * 0.86, width * 0.7, height * 0.12, dark, 0, 0, height * 0.92),
    box(length * 0.06, width * 0.5, height * 0.2, paint(GLASS), length * 0.49, 0, wheel + height * 0.2),
  ];
}

/** A box on four wheels with a cab, one metre long: a rover of no known model. */
export const rover: Builder = (skin, dark) => [box(1, 0.576, 0.26, skin, 0, 0, 0.3), box(0.3, 0.36, 0.16, dark, 0.22, 0, 0.51)];

export const turtlebot: Builder = (skin, dark) => [
  upright(0.17, 0.09, dark, 0, 0, 0.06),
  ...axles(0.1, 0.1).map(([x, y]) => upright(0.008, 0.2, dark, x, y, 0.2)),
  upright(0.16, 0.012, skin, 0, 0, 0.19),
  upright(0.16, 0.012, skin, 0, 0, 0.3),
  upright(0.045, 0.05, dark, 0, 0, 0.33),
];

/** A flat box with a strip of light around it. */
export const carrier: Builder = (skin, dark) => [
  box(0.8, 0.58, 0.2, skin, 0, 0, 0.16),
  box(0.81, 0.59, 0.03, paint(GLASS), 0, 0, 0.2),
  box(0.74, 0.52, 0.04, dark, 0, 0, 0.28),
];

/** A pallet truck: cab behind, mast and two forks ahead. */
export const truck: Builder = (skin, dark) => [
  box(0.8, 0.8, 0.7, skin, -0.5, 0, 0.5),
  box(0.06, 0.7, 0.9, dark, -0.84, 0, 1.2),
  box(0.8, 0.7, 0.06, dark, -0.5, 0, 1.66),
  ...[0.28, -0.28].flatMap((y) => [box(0.1, 0.08, 2, dark, 0, y, 1), box(0.95, 0.13, 0.05, paint(0x7b828c), 0.52, y, 0.12)]),
  box(0.05, 0.66, 0.3, dark, 0.06, 0, 0.28),
];

/** A round base, a torso, a head and an arm ahead. */
export const manipulator: Builder = (skin, dark) => [
  upright(0.27, 0.3, dark, 0, 0, 0.2),
  box(0.2, 0.3, 0.7, skin, -0.08, 0, 0.7),
  box(0.16, 0.24, 0.12, dark, 0, 0, 1.1),
  box(0.02, 0.18, 0.05, paint(GLASS), 0.09, 0, 1.1),
  rod(0.055, 0.32, skin, 0.22, 0, 0.78),
  rod(0.045, 0.26, dark, 0.5, 0, 0.78),
];

/** A small base, a mast and an arm to the side. */
export const mast: Builder = (skin, dark) => [
  box(0.34, 0.33, 0.15, dark, 0, 0, 0.1),
  upright(0.03, 1.2, paint(0x7b828c), -0.06, 0.05, 0.75),
  box(0.08, 0.1, 0.1, dark, -0.04, 0.05, 1.38),
  box(0.06, 0.5, 0.06, skin, -0.02, -0.22, 0.8),
  box(0.12, 0.06, 0.06, dark, 0.02, -0.48, 0.8),
];
