/** Robots from simple solids, posed from samples of their motion. */

import { BoxGeometry, CapsuleGeometry, CircleGeometry, Color, CylinderGeometry, Group, Mesh, MeshBasicMaterial, SphereGeometry, TorusGeometry, Vector3 } from "three";
import type { BufferGeometry, Material } from "three";
import type { Kind, Sample } from "./motion";
import { DARK, GLASS, axles, box, column, paint, shade, solid, upright, type Body, type Doing } from "./solids";
import { Grounded, Vehicle, buggy, carrier, manipulator, mast, rover, truck, turtlebot } from "./vehicles";

const UP = new Vector3(0, 0, 1);

/** Bodies of library models, in metres of the real robots. */
const MODELS: Record<string, (size: number, colour: string) => Body> = {
  cassie: (_, colour) => new Biped(colour, false),
  spot: (size, colour) => new Quadruped(size / 1.21, colour, 1.1, 0.5, 0.84),
  go2: (size, colour) => new Quadruped(size / 0.77, colour, 0.7, 0.31, 0.4),
  turtlebot4: (size, colour) => new Vehicle(size / 0.35, colour, turtlebot, 0.036, [], [0, 0.31, 0.3]),
  jackal: (size, colour) => new Vehicle(size / 0.67, colour, buggy(0.508, 0.43, 0.25, 0.095), 0.095, axles(0.13, 0.19), [0, 0.25, 0.4]),
  husky: (size, colour) => new Vehicle(size / 1.2, colour, buggy(0.99, 0.67, 0.39, 0.165), 0.165, axles(0.256, 0.285), [0, 0.39, 0.7]),
  mir250: (size, colour) => new Vehicle(size / 0.99, colour, carrier, 0.08, axles(0.25, 0.22), [0, 0.3, 0.75]),
  forklift: (size, colour) => new Vehicle(size / 2.2, colour, truck, 0.15, axles(0.45, 0.36), [0.6, 0.15, 0.95]),
  fetch: (size, colour) => new Vehicle(size / 0.56, colour, manipulator, 0.06, axles(0, 0.19), [0.7, 0.66, 0.25]),
  stretch: (size, colour) => new Vehicle(size / 0.48, colour, mast, 0.05, axles(0, 0.16), [0.02, 0.84, 0.2]),
};

/** Models of the library that fly. */
const FLYERS: Record<string, Airframe> = {
  crazyflie: { hub: "board", rings: false, legs: 0 },
  bebop2: { hub: "nose", rings: false, legs: 0 },
  x500: { hub: "plate", rings: false, legs: 0.55 },
};

interface Airframe {
  hub: "ball" | "board" | "nose" | "plate";
  rings: boolean;
  /** Height of its landing gear, in reaches of its arms. */
  legs: number;
}

/** Return the value of the longest key that a name equals or ends in after `_` or `-`: `lab_husky` looks like `husky`. */
export function likeness<T>(known: Record<string, T>, name: string): T | null {
  const plain = name.replaceAll("-", "_");
  const fits = Object.keys(known).filter((key) => plain === key || plain.endsWith(`_${key}`));
  fits.sort((a, b) => b.length - a.length);
  return fits.length ? known[fits[0]!]! : null;
}

export function bodyOf(model: string, kind: Kind, size: number, colour: string, turns: boolean): Body {
  const known = likeness(MODELS, model);
  const legs = likeness({ cassie: true }, model) !== null;
  if (known !== null && kind !== "flyer" && (kind === "walker") === legs) return known(size, colour);
  switch (kind) {
    case "walker":
      return new Biped(colour);
    case "flyer":
      return new Quadrotor(size, colour, likeness(FLYERS, model) ?? { hub: "ball", rings: true, legs: 0 });
    case "rover":
      return new Vehicle(Math.max(0.3, size), colour, rover, 0.17, axles(0.32, 0.33), [-0.1, 0.43, 0.7]);
    case "disc":
      return new Disc(size, colour, turns);
  }
}

/** A limb between two points: a cylinder of unit length along z, stretched and turned. */
class Limb {
  readonly mesh: Mesh;
  private readonly along = new Vector3();

  constructor(radius: number, material: Material) {
    const geometry = new CylinderGeometry(radius, radius * 0.8, 1, 10).rotateX(Math.PI / 2);
    this.mesh = new Mesh(geometry, material);
  }

  span(from: Vector3, to: Vector3): void {
    this.along.subVectors(to, from);
    const length = this.along.length();
    this.mesh.position.addVectors(from, to).multiplyScalar(0.5);
    this.mesh.scale.set(1, 1, length);
    if (length > 1e-6) this.mesh.quaternion.setFromUnitVectors(UP, this.along.divideScalar(length));
  }
}

/** Two links from `root` to `tip`; the joint lies on the side of `bend`. Lengths are equal. */
function joint(root: Vector3, tip: Vector3, length: number, bend: Vector3): Vector3 {
  const way = new Vector3().subVectors(tip, root);
  const half = Math.min(way.length() / 2, length * 0.9999);
  const out = Math.sqrt(length * length - half * half);
  const unit = way.normalize();
  const side = bend.clone().addScaledVector(unit, -bend.dot(unit)).normalize();
  return root.clone().addScaledVector(unit, half).addScaledVector(side, out);
}

const LINK = 0.44;
const HIP = 0.1;
const ANKLE = 0.07;
const PELVIS = 0.06;
const SHOULDER = 0.2;
const ARM = 0.27;

/** Digit-like: knees bend backwards, arms swing against the legs and reach out to push. */
class Biped implements Body {
  readonly group = new Group();
  readonly top: number;
  readonly hold: [number, number] = [0.42, 0.95];
  readonly room = 0.35;
  private readonly torso = new Group();
  private readonly feet: Mesh[];
  private readonly legs: [Limb, Limb][];
  private readonly arms: [Limb, Limb][];
  private readonly ground = shade(0.26);

  /** `whole`: with head and arms, as Digit; Cassie has a pelvis on legs only. */
  constructor(colour: string, whole = true) {
    this.top = whole ? 1.75 : 1.2;
    const [skin, dark] = [paint(colour), paint(DARK)];
    const trunk = column(0.14, 0.34, skin, 0, 0, 0.42);
    trunk.scale.set(0.85, 1.15, 1);
    const pelvis = box(0.18, 0.28, 0.12, dark);
    const head = box(0.14, 0.2, 0.14, dark, 0.02, 0, 0.82);
    const visor = box(0.02, 0.16, 0.06, paint(GLASS), 0.095, 0, 0.83);
    const hip = box(0.26, 0.36, 0.2, skin, 0, 0, 0.08);
    this.torso.add(...(whole ? [trunk, pelvis, head, visor] : [hip]));
    this.feet = [0, 1].map(() => box(0.2, 0.09, 0.05, dark));
    this.legs = [0, 1].map(() => [new Limb(0.06, skin), new Limb(0.045, dark)]);
    this.arms = [0, 1].map(() => [new Limb(0.045, skin), new Limb(0.035, dark)]);
    this.group.add(this.torso, this.ground, ...this.feet);
    for (const limbs of [...this.legs, ...(whole ? this.arms : [])]) this.group.add(limbs[0].mesh, limbs[1].mesh);
  }

  pose(sample: Sample, _seconds: number, doing: Doing | null): void {
    const yaw = sample.yaw!;
    const forward = new Vector3(Math.cos(yaw), Math.sin(yaw), 0);
    const left = new Vector3(-forward.y, forward.x, 0);
    const feet = ["l", "r"].map((s) => new Vector3(sample[`${s}x`], sample[`${s}y`], sample[`${s}z`]));
    const hips = new Vector3(sample.x, sample.y, sample.z! - PELVIS);
    // The pelvis sinks where a stride is longer than the legs at the height of the model.
    for (const [i, foot] of feet.entries()) {
      const hip = hips.clone().addScaledVector(left, i === 0 ? HIP : -HIP);
      const flat = Math.hypot(hip.x - foot.x, hip.y - foot.y);
      const most = foot.z + ANKLE + Math.sqrt(Math.max(0.01, (1.98 * LINK) ** 2 - flat * flat));
      hips.z = Math.min(hips.z, most);
    }
    this.torso.position.copy(hips);
    this.torso.rotation.set(0, 0, yaw);
    this.ground.position.set(hips.x, hips.y, 0.012);
    const reach = doing?.action === "push" ? doing.strength : 0;
    for (const [i, foot] of feet.entries()) {
      const sign = i === 0 ? 1 : -1;
      const turn = sample[i === 0 ? "lyaw" : "ryaw"]!;
      this.feet[i]!.position.set(foot.x, foot.y, foot.z + 0.025);
      this.feet[i]!.rotation.set(0, 0, turn);
      const hip = hips.clone().addScaledVector(left, sign * HIP);
      const ankle = foot.clone().setZ(foot.z + ANKLE);
      const knee = joint(hip, ankle, LINK, forward.clone().negate());
      this.legs[i]![0].span(hip, knee);
      this.legs[i]![1].span(knee, ankle);
      const other = feet[1 - i]!;
      const swing = (other.x - hips.x) * forward.x + (other.y - hips.y) * forward.y;
      const shoulder = hips.clone().addScaledVector(left, sign * SHOULDER).setZ(hips.z + 0.62);
      const hanging = shoulder.clone().addScaledVector(forward, 0.1 + 0.8 * swing).setZ(hips.z + 0.18);
      const pushing = shoulder.clone().addScaledVector(forward, 0.5).setZ(hips.z + 0.5);
      const hand = hanging.lerp(pushing, reach);
      const elbow = joint(shoulder, hand, ARM, forward.clone().negate().setZ(-0.4));
      this.arms[i]![0].span(shoulder, elbow);
      this.arms[i]![1].span(elbow, hand);
    }
  }
}

/** Four rotors on a cross; tilts as it flies. */
class Quadrotor implements Body {
  readonly group = new Group();
  readonly top = 0.45;
  readonly hold: [number, number];
  readonly room: number;
  private readonly frame = new Group();
  private readonly rotors: Mesh[];
  private readonly ground: Mesh;
  private readonly cone: Mesh;

  constructor(size: number, colour: string, { hub, rings, legs }: Airframe) {
    const reach = Math.max(0.18, size / 2) * 0.72;
    const radius = reach * 0.55;
    this.room = reach;
    this.hold = [0, -reach - reach * 0.3];
    const dark = paint(DARK);
    const blade = new MeshBasicMaterial({ color: new Color(colour), transparent: true, opacity: 0.35, depthWrite: false });
    const skin = paint(colour);
    const hubs: Record<Airframe["hub"], BufferGeometry> = {
      ball: new SphereGeometry(reach * 0.42, 16, 10).scale(1.2, 0.9, 0.5),
      board: new BoxGeometry(reach * 0.75, reach * 0.6, reach * 0.16),
      nose: new CapsuleGeometry(reach * 0.22, reach * 0.9, 4, 12).rotateZ(Math.PI / 2),
      plate: new BoxGeometry(reach * 0.9, reach * 0.7, reach * 0.2),
    };
    this.frame.add(solid(hubs[hub], skin, hub === "nose" ? reach * 0.15 : 0));
    for (const y of legs ? [1, -1] : []) {
      const skid = new Limb(reach * 0.05, dark);
      const [foot, half] = [new Vector3(0, y * reach * 0.55, -reach * legs), reach * 0.55];
      skid.span(foot.clone().setX(-half), foot.clone().setX(half));
      const strut = new Limb(reach * 0.05, dark);
      strut.span(new Vector3(0, y * reach * 0.25, 0), foot);
      this.frame.add(skid.mesh, strut.mesh);
    }
    this.frame.add(solid(new SphereGeometry(reach * 0.14, 10, 8), paint(GLASS), reach * 0.45, 0, 0));
    this.rotors = [];
    for (let i = 0; i < 4; i++) {
      const angle = Math.PI / 4 + (i * Math.PI) / 2;
      const [x, y] = [Math.cos(angle) * reach, Math.sin(angle) * reach];
      const arm = new Limb(reach * 0.06, dark);
      arm.span(new Vector3(), new Vector3(x, y, 0.02));
      const disc = solid(new CircleGeometry(radius, 20), blade, x, y, 0.045);
      const bar = box(radius * 1.9, radius * 0.16, 0.008, dark, x, y, 0.05);
      this.rotors.push(bar);
      this.frame.add(arm.mesh, disc, bar);
      if (rings) this.frame.add(solid(new TorusGeometry(radius, reach * 0.04, 6, 24), dark, x, y, 0.04));
      else this.frame.add(upright(reach * 0.12, reach * 0.14, dark, x, y, 0.01));
    }
    this.ground = shade(reach);
    const beam = new MeshBasicMaterial({ color: 0xffd36b, transparent: true, opacity: 0.28, depthWrite: false });
    this.cone = new Mesh(new CylinderGeometry(0.02, 0.75, 1, 24, 1, true).translate(0, -0.5, 0), beam);
    this.cone.visible = false;
    this.group.add(this.frame, this.ground, this.cone);
  }

  pose(sample: Sample, seconds: number, doing: Doing | null): void {
    this.frame.position.set(sample.x!, sample.y!, sample.z!);
    this.frame.quaternion.set(sample.qx ?? 0, sample.qy ?? 0, sample.qz ?? 0, sample.qw ?? 1).normalize();
    if (sample.qw === undefined) this.frame.rotation.set(0, 0, sample.yaw ?? 0);
    this.ground.position.set(sample.x!, sample.y!, 0.012);
    this.rotors.forEach((rotor, i) => (rotor.rotation.z = seconds * (i % 2 ? 19 : -19) + i));
    this.cone.visible = doing?.action === "sense" && doing.strength > 0;
    if (this.cone.visible) this.aim(sample);
  }

  /** The sensor's cone looks ahead and down, into the region that the robot faces. */
  private aim(sample: Sample): void {
    const ahead = new Vector3(1, 0, 0).applyQuaternion(this.frame.quaternion).setZ(0).normalize();
    const way = ahead.multiplyScalar(2.1).setZ(-sample.z!);
    this.cone.position.set(sample.x!, sample.y!, sample.z!);
    this.cone.scale.set(1, way.length(), 1);
    this.cone.quaternion.setFromUnitVectors(new Vector3(0, -1, 0), way.normalize());
  }
}

/** Four legs whose knees bend backwards; they trot as far as it moves. */
class Quadruped extends Grounded {
  readonly top: number;
  readonly hold: [number, number];
  readonly room: number;
  private readonly legs: [Limb, Limb][];
  private readonly hips: Vector3[];
  private readonly high: number;

  constructor(scale: number, colour: string, length: number, width: number, height: number) {
    super();
    const [skin, dark] = [paint(colour), paint(DARK)];
    this.high = height * 0.72;
    this.hold = [-0.1 * length * scale, (this.high + height * 0.2) * scale];
    this.room = width * 0.8 * scale;
    this.top = height * scale + 0.3;
    this.hips = axles(length * 0.33, width * 0.4).map(([x, y]) => new Vector3(x, y, this.high));
    this.legs = this.hips.map(() => [new Limb(height * 0.055, skin), new Limb(height * 0.035, dark)]);
    const inner = new Group();
    inner.add(
      box(length * 0.8, width * 0.5, height * 0.24, skin, 0, 0, this.high + height * 0.08),
      box(length * 0.14, width * 0.42, height * 0.2, dark, length * 0.43, 0, this.high + height * 0.1),
      box(0.01, width * 0.3, height * 0.05, paint(GLASS), length * 0.505, 0, this.high + height * 0.12),
      ...this.legs.flat().map((limb) => limb.mesh),
    );
    inner.scale.setScalar(scale);
    this.group.add(inner, shade(length * 0.5 * scale));
  }

  protected override move(gone: number, moves: boolean): void {
    this.hips.forEach((hip, i) => {
      // Diagonal legs swing together.
      const phase = (gone / this.high) * 4 + (i === 0 || i === 3 ? 0 : Math.PI);
      const stride = moves ? 0.25 * this.high : 0;
      const foot = new Vector3(hip.x + stride * Math.sin(phase), hip.y, Math.max(0, stride * 0.5 * Math.cos(phase)));
      const knee = joint(hip, foot, this.high * 0.56, new Vector3(-1, 0, 0));
      this.legs[i]![0].span(hip, knee);
      this.legs[i]![1].span(knee, foot);
    });
  }
}

/** A robot without a motion model. */
class Disc extends Grounded {
  readonly top = 0.6;
  readonly hold: [number, number] = [0, 0.28];
  readonly room: number;

  /** `turns`: whether it has a heading to show. */
  constructor(size: number, colour: string, turns: boolean) {
    super();
    const radius = Math.max(0.15, size / 2);
    this.room = radius * 1.3;
    this.group.add(upright(radius, 0.25, paint(colour), 0, 0, 0.14), shade(radius * 1.1));
    if (!turns) return;
    // A wedge on top and a light at the front show where it faces.
    const wedge = upright(radius * 0.55, 0.06, paint(DARK), radius * 0.15, 0, 0.29, radius * 0.55, 3);
    wedge.geometry.rotateZ(Math.PI / 2);
    this.group.add(wedge, box(radius * 0.3, radius * 0.9, 0.1, paint(GLASS), radius * 0.92, 0, 0.16));
  }
}
