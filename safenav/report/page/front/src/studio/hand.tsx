/** The hand that draws: walls, floor, robots, obstacles, objectives. */

import { useEffect, useRef, useState } from "preact/hooks";
import { type MARKS, ordered, square as squareOf } from "../map/shapes";
import type { Hand } from "../map/cursor";
import { notice } from "../panels/shell";
import { isWall, label, regionAt as regionOf, useRedraw } from "../run/run";
import { type Chosen, targetsOf, type DrawnObstacle, type DrawnRobot } from "./model";
import type { Drawn } from "./draw";

/** The item held between a press and its release. */
type Held =
  | { what: "paint"; wall: boolean; regions: Set<number>; last: [number, number] }
  | { what: "item"; item: DrawnRobot | DrawnObstacle; from: number }
  | { what: "target"; robot: string; place: number };

export function useDrawingHand(args: Omit<Drawn, "doc">): Hand {
  const { drawing, pen, setPen, chosen, choose, say } = args;
  const held = useRef<Held | null>(null);
  const [hovered, hover] = useState(-1);
  const redraw = useRedraw();
  const { rows, cols } = drawing.run;
  const regionAt = (x: number, y: number): number => regionOf(drawing.run, x, y);
  const edit = (op: string, data: object): void => say("edit", { op, ...data });
  const itemsAt = (region: number): (DrawnRobot | DrawnObstacle)[] => [
    ...drawing.robots.filter((robot) => robot.start === region),
    ...drawing.obstacles.filter((obstacle) => obstacle.region === region),
  ];
  const keyOf = (item: DrawnRobot | DrawnObstacle): Chosen => ("name" in item ? item.name : item.index);
  const picked = drawing.robots.find((robot) => robot.name === chosen);

  // A robot or an obstacle that was just put down is selected as soon as the text has it.
  const awaited = useRef(-1);
  useEffect(() => {
    const put = itemsAt(awaited.current).find((item) => pen.does === ("name" in item ? "robot" : "obstacle"));
    if (put === undefined) return;
    choose(keyOf(put));
    awaited.current = -1;
  }, [drawing]);

  const select = (region: number): boolean => {
    const item = itemsAt(region)[0];
    if (item) {
      choose(keyOf(item));
      held.current = { what: "item", item, from: region };
      return true;
    }
    const place = picked ? picked.targets.findIndex((target) => target.length === 1 && target[0] === region) : -1;
    if (picked && place >= 0) {
      held.current = { what: "target", robot: picked.name, place };
      return true;
    }
    choose(null);
    return false; // a drag moves a map that is not shown whole
  };

  /** Whether something can be put down there; a message explains why not. */
  const free = (region: number, what: string): boolean => {
    const wall = isWall(drawing.run, region);
    if (wall) notice(`Region ${label(drawing.run, region)} is a wall: ${what} needs floor.`);
    return !wall;
  };

  const down = (x: number, y: number): boolean => {
    const region = regionAt(x, y);
    if (pen.does === "select") return select(region);
    if (region < 0) return false;
    if (pen.does === "wall" || pen.does === "floor") {
      held.current = { what: "paint", wall: pen.does === "wall", regions: new Set([region]), last: [x, y] };
      redraw();
    } else if (pen.does === "robot") {
      const there = drawing.robots.find((robot) => robot.start === region);
      if (there) {
        setPen({ does: "select" });
        choose(there.name);
      } else if (free(region, "a robot")) {
        awaited.current = region;
        edit("add_robot", { model: pen.model, region, ...(pen.turns && { heading: "east" }) });
      }
    } else if (pen.does === "obstacle") {
      if (free(region, "an obstacle")) {
        awaited.current = region;
        edit("add_obstacle", { type: pen.type, region });
      }
    }
    else if (free(region, "a target")) {
      const targets = [...pen.targets, region];
      const { kind, least, most } = pen.kind;
      if (targets.length >= least) edit("set_objective", { robot: pen.robot, kind, regions: targets });
      setPen(targets.length >= (most ?? Infinity) ? { does: "select" } : { ...pen, targets });
    }
    return true;
  };

  const move = (x: number, y: number): void => {
    const region = regionAt(x, y);
    if (region !== hovered) hover(region);
    const now = held.current;
    if (now?.what === "paint") {
      for (const passed of line(now.last, [x, y], regionAt)) now.regions.add(passed);
      now.last = [x, y];
      redraw();
    }
  };

  const up = (x: number, y: number): void => {
    const now = held.current;
    held.current = null;
    redraw();
    const region = regionAt(x, y);
    if (now === null) return;
    if (now.what === "paint") edit("paint", { regions: [...now.regions], wall: now.wall });
    else if (region < 0) return;
    else if (now.what === "item" && region !== now.from) {
      if ("name" in now.item) edit("move_robot", { robot: now.item.name, region });
      else edit("move_obstacle", { index: now.item.index, region });
    }
    else if (now.what === "target" && picked && picked.kind) {
      const regions = targetsOf(picked).map((target, i) => (i === now.place ? region : target));
      edit("set_objective", { robot: picked.name, kind: picked.kind, regions });
    }
  };

  const square = (region: number, kind: keyof typeof MARKS, key: string) => squareOf(drawing.run, region, kind, key);
  const painting = held.current?.what === "paint" ? held.current : null;
  const order = pen.does === "objective" ? pen.targets : (picked?.targets.map((target) => target[0]!) ?? []);
  const picture = drawing.obstacles.find(({ index }) => index === chosen);
  const dragged = held.current !== null && held.current.what !== "paint";
  return {
    cursor: pen.does === "select" ? "default" : "crosshair",
    down,
    move,
    up,
    drop: () => {
      held.current = null;
      awaited.current = -1;
      hover(-1);
    },
    leave: () => hover(-1),
    over: (
      <>
        {painting &&
          [...painting.regions].map((region) => square(region, painting.wall ? "wall" : "floor", `p${region}`))}
        {picked && square(picked.start, "picked", "picked")}
        {picture && square(picture.region, "picked", "picked")}
        {(order.length > 1 || pen.does === "objective") && ordered(drawing.run, order)}
        {hovered >= 0 && hovered < rows * cols && (pen.does !== "select" || dragged) && square(hovered, "hover", "hover")}
      </>
    ),
  };
}

/** The regions between two places of a stroke. */
function line(from: [number, number], to: [number, number], regionAt: (x: number, y: number) => number): number[] {
  const steps = Math.ceil(Math.max(Math.abs(to[0] - from[0]), Math.abs(to[1] - from[1])) * 3) || 1;
  const found: number[] = [];
  for (let i = 0; i <= steps; i++) {
    const part = i / steps;
    const region = regionAt(from[0] + (to[0] - from[0]) * part, from[1] + (to[1] - from[1]) * part);
    if (region >= 0) found.push(region);
  }
  return found;
}
