/** Bodies that drive, and how those of known models look. */

import { BoxGeometry, CapsuleGeometry, CylinderGeometry, Group, type Material, type Mesh } from "three";
import type { Body } from "./body";
import type { Sample } from "./motion";
import { DARK, axles, paint, shade, solid, upright } from "./solids";

type Builder = (add: (mesh: Mesh) => void, skin: Material, dark: Material) => void;

/** A body that drives: what the builder adds, and wheels that roll. x is ahead, z up, in metres. */
export class Vehicle implements Body {
  readonly group = new Group();
  readonly top: number;
  readonly hold: [number, number];
  readonly room: number;
  private readonly radius: number;
  private readonly wheels: Mesh[] = [];
  private previous: [x: number, y: number] | null = null;
  private rolled = 0;

  constructor(scale: number, colour: string, build: Builder, radius: number, places: [x: number, y: number][], [ahead, up, room]: [number, number, number]) {
    this.radius = radius * scale;
    [this.hold, this.room] = [[ahead * scale, up * scale], room * scale];
    const inner = new Group();
    let high = 0;
    build(
      (mesh) => {
        mesh.geometry.computeBoundingBox();
        high = Math.max(high, mesh.position.z + mesh.geometry.boundingBox!.max.z);
        inner.add(mesh);
      },
      paint(colour),
      paint(DARK),
    );
    for (const [x, y] of places) this.wheels.push(solid(new CylinderGeometry(radius, radius, radius * 0.6, 14), paint(DARK), x, y, radius));
    for (const wheel of this.wheels) inner.add(wheel);
    inner.scale.setScalar(scale);
    this.group.add(inner, shade(0.3 * scale + 0.1));
    this.top = high * scale + 0.3;
  }

  pose(sample: Sample): void {
    if (this.previous !== null) this.rolled += Math.hypot(sample.x! - this.previous[0], sample.y! - this.previous[1]) / this.radius;
    this.previous = [sample.x!, sample.y!];
    this.group.position.set(sample.x!, sample.y!, 0);
    this.group.rotation.z = sample.yaw ?? 0;
    for (const wheel of this.wheels) wheel.rotation.y = this.rolled;
  }
}

/** A low chassis between four wheels, with a raised deck. */
export function buggy(length: number, width: number, height: number, wheel: number): Builder {
  return (add, skin, dark) => {
    add(solid(new BoxGeometry(length, width * 0.58, height * 0.5), skin, 0, 0, wheel + height * 0.2));
    add(solid(new BoxGeometry(length * 0.86, width * 0.7, height * 0.12), dark, 0, 0, height * 0.92));
    add(solid(new BoxGeometry(length * 0.06, width * 0.5, height * 0.2), paint(0x8fd3ff), length * 0.49, 0, wheel + height * 0.2));
  };
}

/** A box on four wheels with a cab, one metre long: a rover of no known model. */
export const rover: Builder = (add, skin, dark) => {
  add(solid(new BoxGeometry(1, 0.576, 0.26), skin, 0, 0, 0.3));
  add(solid(new BoxGeometry(0.3, 0.36, 0.16), dark, 0.22, 0, 0.51));
};

export const turtlebot: Builder = (add, skin, dark) => {
  add(upright(0.17, 0.09, dark, 0, 0, 0.06));
  for (const [x, y] of axles(0.1, 0.1)) add(upright(0.008, 0.2, dark, x, y, 0.2));
  add(upright(0.16, 0.012, skin, 0, 0, 0.19));
  add(upright(0.16, 0.012, skin, 0, 0, 0.3));
  add(upright(0.045, 0.05, dark, 0, 0, 0.33));
};

/** A flat box with a strip of light around it. */
export const carrier: Builder = (add, skin, dark) => {
  add(solid(new BoxGeometry(0.8, 0.58, 0.2), skin, 0, 0, 0.16));
  add(solid(new BoxGeometry(0.81, 0.59, 0.03), paint(0x8fd3ff), 0, 0, 0.2));
  add(solid(new BoxGeometry(0.74, 0.52, 0.04), dark, 0, 0, 0.28));
};

/** A pallet truck: cab behind, mast and two forks ahead. */
export const truck: Builder = (add, skin, dark) => {
  add(solid(new BoxGeometry(0.8, 0.8, 0.7), skin, -0.5, 0, 0.5));
  add(solid(new BoxGeometry(0.06, 0.7, 0.9), dark, -0.84, 0, 1.2));
  add(solid(new BoxGeometry(0.8, 0.7, 0.06), dark, -0.5, 0, 1.66));
  for (const y of [0.28, -0.28]) {
    add(solid(new BoxGeometry(0.1, 0.08, 2), dark, 0, y, 1));
    add(solid(new BoxGeometry(0.95, 0.13, 0.05), paint(0x7b828c), 0.52, y, 0.12));
  }
  add(solid(new BoxGeometry(0.05, 0.66, 0.3), dark, 0.06, 0, 0.28));
};

/** A round base, a torso, a head and an arm ahead. */
export const manipulator: Builder = (add, skin, dark) => {
  add(upright(0.27, 0.3, dark, 0, 0, 0.2));
  add(solid(new BoxGeometry(0.2, 0.3, 0.7), skin, -0.08, 0, 0.7));
  add(solid(new BoxGeometry(0.16, 0.24, 0.12), dark, 0, 0, 1.1));
  add(solid(new BoxGeometry(0.02, 0.18, 0.05), paint(0x8fd3ff), 0.09, 0, 1.1));
  add(solid(new CapsuleGeometry(0.055, 0.32, 4, 10).rotateZ(Math.PI / 2), skin, 0.22, 0, 0.78));
  add(solid(new CapsuleGeometry(0.045, 0.26, 4, 10).rotateZ(Math.PI / 2), dark, 0.5, 0, 0.78));
};

/** A small base, a mast and an arm to the side. */
export const mast: Builder = (add, skin, dark) => {
  add(solid(new BoxGeometry(0.34, 0.33, 0.15), dark, 0, 0, 0.1));
  add(upright(0.03, 1.2, paint(0x7b828c), -0.06, 0.05, 0.75));
  add(solid(new BoxGeometry(0.08, 0.1, 0.1), dark, -0.04, 0.05, 1.38));
  add(solid(new BoxGeometry(0.06, 0.5, 0.06), skin, -0.02, -0.22, 0.8));
  add(solid(new BoxGeometry(0.12, 0.06, 0.06), dark, 0.02, -0.48, 0.8));
};
