/** The map: ground, lines between regions, walls (low, so that nothing hides behind them). */

import { BoxGeometry, BufferGeometry, Float32BufferAttribute, Group, InstancedMesh, LineBasicMaterial, LineSegments } from "three";
import { Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PlaneGeometry } from "three";
import { isWall, placeOf, type Run } from "../run/run";
import { pictogram, themeColour } from "./solids";

const WALL = 0.35;

/** The centre of a region on the ground, in metres. */
export function centreOf(run: Run, side: number, region: number): [x: number, y: number] {
  const [col, row] = placeOf(run, region);
  return [(col + 0.5) * side, (run.rows - row - 0.5) * side];
}

export class Floor {
  readonly group = new Group();
  /** West, south, east and north of the visible area, in metres. */
  readonly extent: [west: number, south: number, east: number, north: number];
  private readonly walls: InstancedMesh<BoxGeometry, MeshLambertMaterial>;
  private readonly ground: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly chargers: Mesh<PlaneGeometry, MeshBasicMaterial>[];

  constructor(run: Run, side: number) {
    const all = [...Array(run.rows * run.cols).keys()];
    const free = all.filter((region) => !isWall(run, region));
    const centres = free.map((region) => centreOf(run, side, region));
    const [xs, ys] = [centres.map(([x]) => x), centres.map(([, y]) => y)];
    const [west, east] = [Math.min(...xs) - side / 2, Math.max(...xs) + side / 2];
    const [south, north] = [Math.min(...ys) - side / 2, Math.max(...ys) + side / 2];
    this.extent = [west - side / 4, south - side / 4, east + side / 4, north + side / 4];
    const [width, depth] = [east - west, north - south];
    this.ground = new Mesh(new PlaneGeometry(width, depth), new MeshBasicMaterial());
    this.ground.position.set(west + width / 2, south + depth / 2, -0.01);
    const points: number[] = [];
    for (let y = south; y < north + side / 2; y += side) points.push(west, y, 0, east, y, 0);
    for (let x = west; x < east + side / 2; x += side) points.push(x, south, 0, x, north, 0);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
    this.lines = new LineSegments(geometry, new LineBasicMaterial());
    const standing = all.filter((region) => isWall(run, region));
    this.walls = new InstancedMesh(new BoxGeometry(side, side, WALL), new MeshLambertMaterial(), standing.length);
    const place = new Matrix4();
    standing.forEach((region, i) => this.walls.setMatrixAt(i, place.makeTranslation(...centreOf(run, side, region), WALL / 2)));
    this.chargers = run.chargers.map((region) => {
      const plate = pictogram(run.charger, 0.5 * side, 0.008);
      plate.position.setX(centreOf(run, side, region)[0]).setY(centreOf(run, side, region)[1]);
      return plate;
    });
    this.group.add(this.ground, this.lines, this.walls, ...this.chargers);
    this.recolour();
  }

  recolour(): void {
    this.ground.material.color = themeColour("ground");
    this.lines.material.color = themeColour("grid");
    this.walls.material.color = themeColour("wall");
    for (const plate of this.chargers) plate.material.color = themeColour("requested");
  }
}
