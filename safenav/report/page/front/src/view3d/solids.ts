/** Simple solids of which bodies are made. */

import { CircleGeometry, Color, CylinderGeometry, Mesh, MeshBasicMaterial, MeshLambertMaterial, type BufferGeometry, type Material } from "three";

export const DARK = 0x2b3038;

export function solid(geometry: BufferGeometry, material: Material, x = 0, y = 0, z = 0): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.position.set(x, y, z);
  return mesh;
}

export function paint(colour: string | number): MeshLambertMaterial {
  return new MeshLambertMaterial({ color: new Color(colour) });
}

/** A round shadow on the ground, below a flying robot. */
export function shade(radius: number): Mesh {
  const material = new MeshBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.22, depthWrite: false });
  return solid(new CircleGeometry(radius, 24), material, 0, 0, 0.012);
}

/** A cylinder that stands. */
export function upright(radius: number, height: number, material: Material, x: number, y: number, z: number): Mesh {
  return solid(new CylinderGeometry(radius, radius, height, 24).rotateX(Math.PI / 2), material, x, y, z);
}

/** Places to the left and right, at the front and the rear unless `x` is 0. */
export function axles(x: number, y: number): [number, number][] {
  return (x === 0 ? [0] : [x, -x]).flatMap((at): [number, number][] => [[at, y], [at, -y]]);
}
