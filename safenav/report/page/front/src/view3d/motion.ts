/**
 * The motion that a 3D page carries (`safenav/report/view3d/html.py`), and the positions of robots
 * at a moment. Metres, seconds, radians; x east, y north, z up, from the map's south-western corner.
 */

export type Kind = "walker" | "flyer" | "rover" | "disc";

export interface Track {
  kind: Kind;
  /** Metres across. */
  size: number;
  /** Names of the columns of `data`, in order. */
  columns: string[];
  /** The columns: of each the first value, then the differences; JSON, deflated, base64. */
  data: string;
  /** The plan of a robot whose motion was measured. */
  ghost?: { columns: string[]; data: string };
  /** Planned footholds: x, y, yaw (thousandths), side (1 left, -1 right), down and up (ms). */
  feet: [x: number, y: number, yaw: number, side: number, down: number, up: number][];
}

export interface Motion {
  side: number;
  seconds: number;
  /** Samples per second. */
  rate: number;
  samples: number;
  tracks: Track[];
  reserved: [robot: number, region: number, from: number, to: number][];
  actions: [robot: number, obstacle: string, action: string, from: number, to: number][];
}

/** The state of a sampled robot at a moment; columns that its kind lacks are undefined. */
export type Sample = Record<string, number>;

export interface Sampled {
  track: Track;
  columns: Map<string, Float32Array>;
  ghost: Map<string, Float32Array> | null;
}

const THOUSANDTHS = 1000;

async function inflated(text: string): Promise<number[][]> {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return JSON.parse(await new Response(stream).text()) as number[][];
}

/** The columns of all robots. */
export async function decoded(motion: Motion): Promise<Sampled[]> {
  return Promise.all(
    motion.tracks.map(async (track) => ({
      track,
      columns: await columnsOf(motion.samples, track.columns, track.data),
      ghost: track.ghost ? await columnsOf(motion.samples, track.ghost.columns, track.ghost.data) : null,
    })),
  );
}

async function columnsOf(samples: number, names: string[], data: string): Promise<Map<string, Float32Array>> {
  const steps = await inflated(data);
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
export function sampleAt(motion: Motion, robot: { columns: Map<string, Float32Array> }, seconds: number): Sample {
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
