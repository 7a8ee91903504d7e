/**
 * The motion that a 3D page carries (`safenav/report/page/motion.py`), and the positions of robots
 * at a moment. Metres, seconds, radians; x east, y north, z up, from the map's south-western corner.
 */

import { BoxGeometry, Color, InstancedMesh, Matrix4, MeshBasicMaterial } from "three";
import { inflated, placeOf, type Run } from "../run/run";

export type Kind = "walker" | "flyer" | "rover" | "disc";

export interface Track {
  kind: Kind;
  /** Metres across. */
  size: number;
  /** Names of the columns of `data`, in order. */
  columns: string[];
  /** The columns: of each the first value, then the differences; JSON, deflated, base64. */
  data: string;
  /** Planned footholds: x, y, yaw (thousandths), and when the foot lands (ms). */
  feet: [x: number, y: number, yaw: number, down: number][];
}

export interface Motion {
  side: number;
  /** Samples per second. */
  rate: number;
  samples: number;
  tracks: Track[];
  actions: [robot: number, obstacle: string, action: string, from: number, to: number][];
}

/** The state of a sampled robot at a moment; columns that its kind lacks are undefined. */
export type Sample = Record<string, number>;

export interface Sampled {
  track: Track;
  columns: Map<string, Float32Array>;
}

const THOUSANDTHS = 1000;

/** The columns of all robots. */
export async function decoded(motion: Motion): Promise<Sampled[]> {
  return Promise.all(
    motion.tracks.map(async (track) => ({
      track,
      columns: await columnsOf(motion.samples, track.columns, track.data),
    })),
  );
}

async function columnsOf(samples: number, names: string[], data: string): Promise<Map<string, Float32Array>> {
  const steps = JSON.parse(await inflated(data)) as number[][];
  const columns = new Map<string, Float32Array>();
  names.forEach((name, c) => {
    const column = new Float32Array(samples);
    let value = 0;
    for (let i = 0; i < samples; i++) {
      value += steps[c]![i]!;
      column[i] = value / THOUSANDTHS;
    }
    columns.set(name, column);
  });
  return columns;
}

/** The values at a moment, between two samples; angles are continuous in the columns. */
export function sampleAt(motion: Motion, robot: Sampled, seconds: number): Sample {
  const place = Math.max(0, Math.min(motion.samples - 1, seconds * motion.rate));
  const before = Math.floor(place);
  const after = Math.min(motion.samples - 1, before + 1);
  const part = place - before;
  const found: Sample = {};
  for (const [name, column] of robot.columns) {
    found[name] = column[before]! + (column[after]! - column[before]!) * part;
  }
  return found;
}

/** The centre of a region on the ground, in metres. */
export function centreOf(run: Run, side: number, region: number): [x: number, y: number] {
  const [col, row] = placeOf(run, region);
  return [(col + 0.5) * side, (run.rows - row - 0.5) * side];
}

const PRINTS = 28;

/** The last and the next planned footholds of a walker. */
export class Footprints {
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
    this.downs = track.feet.map((foot) => foot[3]);
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
