/** The interface of drawn robots, and the simple solids of which robots and obstacles are made. */

import { BoxGeometry, CanvasTexture, CapsuleGeometry, CircleGeometry, Color, CylinderGeometry, Mesh, MeshBasicMaterial, MeshLambertMaterial, PlaneGeometry } from "three";
import type { BufferGeometry, Group, Material } from "three";
import type { Sample } from "./motion";

export interface Body {
  readonly group: Group;
  /** The height of signs above the robot, in metres above its group. */
  readonly top: number;
  /** The position of a load that it holds: metres ahead of its centre, and above its group (a flyer: its centre). */
  readonly hold: [ahead: number, up: number];
  /** The size limit of its loads in metres. */
  readonly room: number;
  pose(sample: Sample, seconds: number): void;
}

export const DARK = 0x2b3038;
export const GLASS = 0x8fd3ff;

export type Role = "page" | "accent" | "ground" | "grid" | "wall" | "ink" | "hidden" | "found" | "requested" | "resolved" | "blocked" | "number";

/** A colour of the page's theme: the stylesheet has both of each, `light-dark(#…, #…)`. */
export function themeColour(role: Role): Color {
  const root = document.documentElement;
  const [light, dark] = getComputedStyle(root).getPropertyValue(`--${role}`).match(/#\w+/g)!;
  return new Color(root.dataset.theme === "dark" ? dark : light);
}

export function paint(colour: string | number): MeshLambertMaterial {
  return new MeshLambertMaterial({ color: new Color(colour) });
}

export function solid(geometry: BufferGeometry, material: Material, x = 0, y = 0, z = 0): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.position.set(x, y, z);
  return mesh;
}

/** A box of a size, at a place. */
export function box(wide: number, deep: number, high: number, material: Material, x = 0, y = 0, z = 0): Mesh {
  return solid(new BoxGeometry(wide, deep, high), material, x, y, z);
}

/** A cylinder that stands. */
export function upright(radius: number, height: number, material: Material, x = 0, y = 0, z = 0, foot = radius, sides = 24): Mesh {
  return solid(new CylinderGeometry(radius, foot, height, sides).rotateX(Math.PI / 2), material, x, y, z);
}

/** A rounded column that stands. */
export function column(radius: number, height: number, material: Material, x = 0, y = 0, z = 0): Mesh {
  return solid(new CapsuleGeometry(radius, height, 4, 12).rotateX(Math.PI / 2), material, x, y, z);
}

/** A round shadow on the ground. */
export function shade(radius: number): Mesh {
  const material = new MeshBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.22, depthWrite: false });
  return solid(new CircleGeometry(radius, 24), material, 0, 0, 0.012);
}

/** A pictogram of the page, which lies on a surface; `turn`: about the vertical, in radians. */
export function pictogram(path: string, side: number, z: number, colour: string | number = 0xffffff, turn = 0): Mesh<PlaneGeometry, MeshBasicMaterial> {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const brush = canvas.getContext("2d")!;
  brush.fillStyle = "#fff";
  brush.setTransform(60, 0, 0, 60, 64, 64);
  brush.fill(new Path2D(path), "evenodd");
  const material = new MeshBasicMaterial({ map: new CanvasTexture(canvas), color: colour, transparent: true, depthWrite: false });
  const plate = new Mesh(new PlaneGeometry(side, side), material);
  plate.position.z = z;
  plate.rotation.z = turn;
  return plate;
}
