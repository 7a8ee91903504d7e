/** Robots from simple solids, posed from samples of their motion. */

import {
  BoxGeometry,
  CapsuleGeometry,
  CircleGeometry,
  Color,
  CylinderGeometry,
  Group,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  SphereGeometry,
  TorusGeometry,
  Vector3,
  type BufferGeometry,
  type Material,
} from "three";
import type { Kind, Sample } from "./motion";

/** What a robot does with its hands or its sensor right now; 0 to 1 as it begins and ends. */
export interface Doing {
  action: string;
  strength: number;
}

export interface Body {
  readonly group: Group;
  /** Where signs over the robot hang, in metres above its group. */
  readonly top: number;
  pose(sample: Sample, seconds: number, doing: Doing | null): void;
}

export function bodyOf(kind: Kind, size: number, colour: string, turns: boolean): Body {
  switch (kind) {
    case "walker":
      return new Biped(colour);
    case "flyer":
      return new Quadrotor(size, colour);
    case "rover":
      return new Rover(size, colour);
    case "disc":
      return new Disc(size, colour, turns);
  }
}

const DARK = 0x2b3038;
const UP = new Vector3(0, 0, 1);

function solid(geometry: BufferGeometry, material: Material, x = 0, y = 0, z = 0): Mesh {
  const mesh = new Mesh(geometry, material);
  mesh.position.set(x, y, z);
  return mesh;
}

function paint(colour: string | number): MeshLambertMaterial {
  return new MeshLambertMaterial({ color: new Color(colour) });
}

/** A round shade on the ground, which tells where something that flies is. */
function shade(radius: number): Mesh {
  const material = new MeshBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.22, depthWrite: false });
  return solid(new CircleGeometry(radius, 24), material, 0, 0, 0.012);
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
function joint(root: Vector3, tip: Vector3, length: number, bend: Vector3, found: Vector3): void {
  const way = new Vector3().subVectors(tip, root);
  const half = Math.min(way.length() / 2, length * 0.9999);
  const out = Math.sqrt(length * length - half * half);
  const unit = way.normalize();
  const side = bend.clone().addScaledVector(unit, -bend.dot(unit)).normalize();
  found.copy(root).addScaledVector(unit, half).addScaledVector(side, out);
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
  readonly top = 1.75;
  private readonly torso = new Group();
  private readonly feet: Mesh[];
  private readonly legs: [Limb, Limb][];
  private readonly arms: [Limb, Limb][];
  private readonly ground = shade(0.26);

  constructor(colour: string) {
    const skin = paint(colour);
    const dark = paint(DARK);
    const trunk = solid(new CapsuleGeometry(0.14, 0.34, 4, 12).rotateX(Math.PI / 2), skin, 0, 0, 0.42);
    trunk.scale.set(0.85, 1.15, 1);
    const pelvis = solid(new BoxGeometry(0.18, 0.28, 0.12), dark);
    const head = solid(new BoxGeometry(0.14, 0.2, 0.14), dark, 0.02, 0, 0.82);
    const visor = solid(new BoxGeometry(0.02, 0.16, 0.06), paint(0x8fd3ff), 0.095, 0, 0.83);
    this.torso.add(trunk, pelvis, head, visor);
    this.feet = [0, 1].map(() => solid(new BoxGeometry(0.2, 0.09, 0.05), dark));
    this.legs = [0, 1].map(() => [new Limb(0.06, skin), new Limb(0.045, dark)]);
    this.arms = [0, 1].map(() => [new Limb(0.045, skin), new Limb(0.035, dark)]);
    this.group.add(this.torso, this.ground, ...this.feet);
    for (const limbs of [...this.legs, ...this.arms]) this.group.add(limbs[0].mesh, limbs[1].mesh);
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
      const knee = new Vector3();
      joint(hip, ankle, LINK, forward.clone().negate(), knee);
      this.legs[i]![0].span(hip, knee);
      this.legs[i]![1].span(knee, ankle);
      const other = feet[1 - i]!;
      const swing = (other.x - hips.x) * forward.x + (other.y - hips.y) * forward.y;
      const shoulder = hips.clone().addScaledVector(left, sign * SHOULDER).setZ(hips.z + 0.62);
      const hanging = shoulder.clone().addScaledVector(forward, 0.1 + 0.8 * swing).setZ(hips.z + 0.18);
      const pushing = shoulder.clone().addScaledVector(forward, 0.5).setZ(hips.z + 0.5);
      const hand = hanging.lerp(pushing, reach);
      const elbow = new Vector3();
      joint(shoulder, hand, ARM, forward.clone().negate().setZ(-0.4), elbow);
      this.arms[i]![0].span(shoulder, elbow);
      this.arms[i]![1].span(elbow, hand);
    }
  }
}

/** Four rotors on a cross; tilts as it flies. */
class Quadrotor implements Body {
  readonly group = new Group();
  readonly top = 0.45;
  private readonly frame = new Group();
  private readonly rotors: Mesh[];
  private readonly ground: Mesh;
  private readonly cone: Mesh;

  constructor(size: number, colour: string) {
    const reach = Math.max(0.18, size / 2) * 0.72;
    const radius = reach * 0.55;
    const dark = paint(DARK);
    const blade = new MeshBasicMaterial({ color: new Color(colour), transparent: true, opacity: 0.35, depthWrite: false });
    this.frame.add(solid(new SphereGeometry(reach * 0.42, 16, 10).scale(1.2, 0.9, 0.5), paint(colour)));
    this.frame.add(solid(new SphereGeometry(reach * 0.14, 10, 8), paint(0x8fd3ff), reach * 0.45, 0, 0));
    this.rotors = [];
    for (let i = 0; i < 4; i++) {
      const angle = Math.PI / 4 + (i * Math.PI) / 2;
      const [x, y] = [Math.cos(angle) * reach, Math.sin(angle) * reach];
      const arm = new Limb(reach * 0.06, dark);
      arm.span(new Vector3(), new Vector3(x, y, 0.02));
      const ring = solid(new TorusGeometry(radius, reach * 0.04, 6, 24), dark, x, y, 0.04);
      const disc = solid(new CircleGeometry(radius, 20), blade, x, y, 0.045);
      const bar = solid(new BoxGeometry(radius * 1.9, radius * 0.16, 0.008), dark, x, y, 0.05);
      this.rotors.push(bar);
      this.frame.add(arm.mesh, ring, disc, bar);
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

/** A box on four wheels. */
class Rover implements Body {
  readonly group = new Group();
  readonly top = 0.85;
  private readonly wheels: Mesh[];
  private previous: [x: number, y: number] | null = null;
  private rolled = 0;

  constructor(size: number, colour: string) {
    const length = Math.max(0.3, size);
    const width = length * 0.72;
    const wheel = length * 0.17;
    this.group.add(
      solid(new BoxGeometry(length, width * 0.8, length * 0.26), paint(colour), 0, 0, wheel + length * 0.13),
      solid(new BoxGeometry(length * 0.3, width * 0.5, length * 0.16), paint(DARK), length * 0.22, 0, wheel + length * 0.34),
    );
    this.wheels = [1, -1].flatMap((x) =>
      [1, -1].map((y) =>
        solid(new CylinderGeometry(wheel, wheel, width * 0.16, 14), paint(DARK), x * length * 0.32, y * width * 0.46, wheel),
      ),
    );
    this.group.add(...this.wheels, shade(length * 0.6));
  }

  pose(sample: Sample): void {
    const radius = this.wheels[0]!.position.z;
    if (this.previous !== null) this.rolled += Math.hypot(sample.x! - this.previous[0], sample.y! - this.previous[1]) / radius;
    this.previous = [sample.x!, sample.y!];
    this.group.position.set(sample.x!, sample.y!, 0);
    this.group.rotation.z = sample.yaw ?? 0;
    for (const wheel of this.wheels) wheel.rotation.y = this.rolled;
  }
}

/** What moves without a model of its motion. */
class Disc implements Body {
  readonly group = new Group();
  readonly top = 0.6;

  /** `turns`: it has a heading, which is shown. */
  constructor(size: number, colour: string, turns: boolean) {
    const radius = Math.max(0.15, size / 2);
    this.group.add(
      solid(new CylinderGeometry(radius, radius, 0.25, 28).rotateX(Math.PI / 2), paint(colour), 0, 0, 0.14),
      shade(radius * 1.1),
    );
    if (!turns) return;
    // A wedge on top and a light at the front show where it faces.
    const wedge = new CylinderGeometry(radius * 0.55, radius * 0.55, 0.06, 3).rotateX(Math.PI / 2).rotateZ(Math.PI / 2);
    const front = solid(new BoxGeometry(radius * 0.3, radius * 0.9, 0.1), paint(0x8fd3ff), radius * 0.92, 0, 0.16);
    front.name = "front";
    this.group.add(solid(wedge, paint(DARK), radius * 0.15, 0, 0.29), front);
  }

  pose(sample: Sample): void {
    this.group.position.set(sample.x!, sample.y!, Math.max(0, (sample.z ?? 0) - 0.14));
    this.group.rotation.z = sample.yaw ?? 0;
  }
}

