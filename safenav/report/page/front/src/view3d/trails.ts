/** Trails of robots: footprints, the path of the centre of mass or of the flight. */

import { BoxGeometry, BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, InstancedMesh, Line } from "three";
import { LineBasicMaterial, Matrix4, MeshBasicMaterial } from "three";
import type { Motion, Sampled, Track } from "./motion";

const SECONDS = 14;
const PRINTS = 28;

/** The last and the next planned footholds of a walker. */
class Footprints {
  readonly mesh: InstancedMesh;
  private readonly downs: number[];
  private drawn = -1;

  constructor(
    private readonly track: Track,
    colour: string,
  ) {
    const material = new MeshBasicMaterial({ color: new Color(colour), transparent: true, opacity: 0.4, depthWrite: false });
    this.mesh = new InstancedMesh(new BoxGeometry(0.2, 0.09, 0.004), material, PRINTS);
    this.mesh.frustumCulled = false;
    this.mesh.count = 0;
    this.downs = track.feet.map((foot) => foot[4]);
  }

  update(seconds: number): void {
    let end = 0;
    while (end < this.downs.length && this.downs[end]! <= seconds * 1000) end++;
    if (end === this.drawn) return;
    this.drawn = end;
    const shown = this.track.feet.slice(Math.max(0, end - PRINTS), end);
    const place = new Matrix4();
    shown.forEach(([x, y, yaw], i) => {
      place.makeRotationZ(yaw / 1000).setPosition(x / 1000, y / 1000, 0.006);
      this.mesh.setMatrixAt(i, place);
    });
    this.mesh.count = shown.length;
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}

export class Trails {
  readonly group = new Group();
  private readonly lines: { line: Line; positions: BufferAttribute; robot: Sampled }[] = [];
  private readonly prints: Footprints[] = [];

  constructor(
    private readonly motion: Motion,
    robots: Sampled[],
    colours: string[],
  ) {
    robots.forEach((robot, i) => {
      const count = Math.ceil(SECONDS * motion.rate) + 2;
      const positions = new BufferAttribute(new Float32Array(count * 3), 3).setUsage(DynamicDrawUsage);
      const geometry = new BufferGeometry().setAttribute("position", positions);
      const line = new Line(geometry, new LineBasicMaterial({ color: new Color(colours[i]) }));
      line.frustumCulled = false;
      this.lines.push({ line, positions, robot });
      this.group.add(line);
      if (robot.track.feet.length > 0) {
        const prints = new Footprints(robot.track, colours[i]!);
        this.prints.push(prints);
        this.group.add(prints.mesh);
      }
    });
  }

  update(seconds: number): void {
    for (const prints of this.prints) prints.update(seconds);
    const last = Math.max(0, Math.min(this.motion.samples - 1, Math.floor(seconds * this.motion.rate)));
    const first = Math.max(0, last - SECONDS * this.motion.rate);
    for (const { line, positions, robot } of this.lines) {
      const [x, y, z] = ["x", "y", "z"].map((name) => robot.columns.get(name));
      const ground = robot.track.kind !== "flyer";
      for (let i = first; i <= last; i++) {
        positions.setXYZ(i - first, x![i]!, y![i]!, ground ? 0.02 : (z?.[i] ?? 0.3));
      }
      positions.needsUpdate = true;
      line.geometry.setDrawRange(0, last - first + 1);
    }
  }
}
