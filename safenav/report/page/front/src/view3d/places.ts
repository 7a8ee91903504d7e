/** Names of regions and areas in the scene, and the borders of areas; none lies over another. */

import { BufferGeometry, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments, Vector3, type PerspectiveCamera, type Sprite } from "three";
import { CELL } from "../map/camera";
import { overlap, type Box } from "../map/names";
import { outline } from "../map/shapes";
import { clamp, type Run } from "../run/run";
import { themeColour } from "./solids";
import { centreOf } from "./floor";
import { FIELD_ANGLE, sign } from "./signs";

const HEIGHT = 0.034;
/** Vertical offsets of a name from its position, in its own heights: on it, below, above, far below. */
const HANGS = [0.5, 1.6, -0.7, 2.7];
const FIELD = 2 * Math.tan((FIELD_ANGLE * Math.PI) / 360);

export class Places {
  readonly group = new Group();
  private readonly signs: Sprite[];
  private readonly borders: LineSegments<BufferGeometry, LineBasicMaterial>;

  constructor(run: Run, side: number) {
    const middle = (regions: readonly number[]): [number, number] => {
      const centres = regions.map((region) => centreOf(run, side, region));
      const mean = (axis: 0 | 1): number => centres.reduce((sum, centre) => sum + centre[axis], 0) / centres.length;
      return [mean(0), mean(1)];
    };
    const named = [
      ...Object.entries(run.names).map(([region, name]) => [name, [Number(region)], false] as const),
      ...Object.entries(run.areas).map(([name, regions]) => [name, regions, true] as const),
    ];
    this.signs = named.map(([name, regions, area]) => {
      const [x, y] = middle(regions);
      const found = sign(name, { ink: area ? "#0067a3" : "#1b1f24", paper: "rgba(255,255,255,0.86)", height: HEIGHT });
      found.name = name;
      found.position.set(x, y - 0.3 * side, 0.05);
      found.renderOrder = 5;
      return found;
    });
    const points = Object.values(run.areas).flatMap((regions) => corners(outline(run, regions), run, side));
    const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
    this.borders = new LineSegments(geometry, new LineBasicMaterial());
    this.borders.frustumCulled = false;
    this.group.add(this.borders, ...this.signs);
  }

  recolour(): void {
    this.borders.material.color = themeColour("accent");
  }

  /** The names, the nearest first. */
  nearest(camera: PerspectiveCamera): Sprite[] {
    const away = (found: Sprite): number => found.position.distanceTo(camera.position);
    return [...this.signs].sort((a, b) => away(a) - away(b));
  }
}

/** Shift a sign sideways into the canvas if its anchor is visible, and return its box; null behind the camera. */
function boxOn(found: Sprite, camera: PerspectiveCamera, canvas: HTMLCanvasElement): Box | null {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const where = found.getWorldPosition(new Vector3()).project(camera);
  if (where.z >= 1) return null;
  const [x, y] = [((where.x + 1) / 2) * width, ((1 - where.y) / 2) * height];
  const [w, h] = [(found.scale.x / FIELD) * height, (found.scale.y / FIELD) * height];
  found.center.x = x < 0 || x > width ? 0.5 : clamp(0.5, 1 - (width - x) / w, x / w);
  const [left, bottom] = [x - found.center.x * w, y + found.center.y * h];
  return { left, right: left + w, top: bottom - h, bottom };
}

/** Hide each sign that would cover an earlier one; the canvas tells which names are visible. */
export function tidy(signs: Sprite[], camera: PerspectiveCamera, canvas: HTMLCanvasElement): void {
  camera.updateMatrixWorld();
  const placed: Box[] = [];
  for (const found of signs) {
    found.visible = (found.name ? HANGS : [found.center.y]).some((hang) => {
      found.center.y = hang;
      const box = boxOn(found, camera, canvas);
      if (box === null || placed.some((other) => overlap(box, other))) return false;
      placed.push(box);
      return true;
    });
  }
  canvas.dataset.names = signs.filter((found) => found.visible && found.name).map((found) => found.name).join(" ");
}

/** Return the lines of a path on the flat map as points on the ground. */
function corners(path: string, run: Run, side: number): number[] {
  const points: number[] = [];
  for (const [, from, down, way, to] of path.matchAll(/M(\S+) (\S+)([HV])([^M]+)/g)) {
    const [x, y] = [Number(from), Number(down)];
    const [right, bottom] = way === "H" ? [Number(to), y] : [x, Number(to)];
    for (const [col, row] of [[x, y], [right, bottom]] as const) {
      points.push((col / CELL) * side, (run.rows - row / CELL) * side, 0.02);
    }
  }
  return points;
}
