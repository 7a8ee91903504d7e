/** The map: ground, lines between regions, walls (low, so that nothing hides behind them). */

import { BoxGeometry, BufferGeometry, CanvasTexture, Float32BufferAttribute, Group, InstancedMesh, LineBasicMaterial, LineSegments } from "three";
import { Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PlaneGeometry } from "three";
import { isWall, placeOf, type Run } from "../run/run";
import { themeColour } from "./solids";

export const LOW = 0.35;
export const HIGH = 2.0;

/** The centre of a region on the ground, in metres. */
export function centreOf(run: Run, side: number, region: number): [x: number, y: number] {
  const [col, row] = placeOf(run, region);
  return [(col + 0.5) * side, (run.rows - row - 0.5) * side];
}

export class Floor {
  readonly group = new Group();
  /** West, south, east and north of the visible area, in metres. */
  readonly extent: [west: number, south: number, east: number, north: number];
  private readonly standing: number[];
  private readonly walls: InstancedMesh<BoxGeometry, MeshLambertMaterial>;
  private readonly ground: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly charger: MeshBasicMaterial;

  constructor(
    private readonly run: Run,
    private readonly side: number,
  ) {
    const all = [...Array(run.rows * run.cols).keys()];
    const free = all.filter((region) => !isWall(run, region));
    const centres = free.map((region) => centreOf(run, side, region));
    const [xs, ys] = [centres.map(([x]) => x), centres.map(([, y]) => y)];
    const [west, east] = [Math.min(...xs) - side / 2, Math.max(...xs) + side / 2];
    const [south, north] = [Math.min(...ys) - side / 2, Math.max(...ys) + side / 2];
    this.extent = [west - side / 4, south - side / 4, east + side / 4, north + side / 4];
    this.standing = all.filter((region) => isWall(run, region));
    const [width, depth] = [east - west, north - south];
    this.ground = new Mesh(new PlaneGeometry(width, depth), new MeshBasicMaterial());
    this.ground.position.set(west + width / 2, south + depth / 2, -0.01);
    const points: number[] = [];
    for (let y = south; y < north + side / 2; y += side) points.push(west, y, 0, east, y, 0);
    for (let x = west; x < east + side / 2; x += side) points.push(x, south, 0, x, north, 0);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
    this.lines = new LineSegments(geometry, new LineBasicMaterial());
    const regions = this.standing;
    this.walls = new InstancedMesh(
      new BoxGeometry(side, side, 1),
      new MeshLambertMaterial({ transparent: true }),
      regions.length,
    );
    this.charger = new MeshBasicMaterial({ map: pictogram(run.charger), transparent: true, depthWrite: false });
    for (const region of run.chargers) {
      const plate = new Mesh(new PlaneGeometry(0.7 * side, 0.7 * side), this.charger);
      plate.position.set(...centreOf(run, side, region), 0.008);
      this.group.add(plate);
    }
    this.group.add(this.ground, this.lines, this.walls);
    this.raise(LOW);
    this.recolour();
  }

  /** Sets the height of all walls. */
  raise(height: number): void {
    const place = new Matrix4();
    this.standing.forEach((region, i) => {
      const [x, y] = centreOf(this.run, this.side, region);
      place.makeScale(1, 1, height).setPosition(x, y, height / 2);
      this.walls.setMatrixAt(i, place);
    });
    this.walls.instanceMatrix.needsUpdate = true;
    this.walls.material.opacity = height > LOW ? 0.6 : 1;
    this.walls.material.needsUpdate = true;
  }

  recolour(): void {
    this.ground.material.color = themeColour("ground");
    this.lines.material.color = themeColour("grid");
    this.walls.material.color = themeColour("wall");
    this.charger.color = themeColour("requested");
  }
}

/** A path within [-1, 1] squared in a ring, in white. */
function pictogram(path: string): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const brush = canvas.getContext("2d")!;
  brush.fillStyle = brush.strokeStyle = "#fff";
  brush.setTransform(40, 0, 0, 40, 64, 64);
  brush.fill(new Path2D(path));
  brush.lineWidth = 0.14;
  brush.arc(0, 0, 1.4, 0, 2 * Math.PI);
  brush.stroke();
  return new CanvasTexture(canvas);
}
