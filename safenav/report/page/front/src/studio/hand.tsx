/** The hand that draws: walls, floor, robots, obstacles, headings, objectives. */

import { useEffect, useRef, useState } from "preact/hooks";
import { CELL } from "../map/camera";
import { centreOf, INK, type MARKS, ordered, square as squareOf } from "../map/shapes";
import type { Hand } from "../map/cursor";
import { notice } from "../panels/shell";
import { HEADINGS, isWall, label, placeOf, regionAt as regionOf, useRedraw } from "../run/run";
import { type Chosen, chooseTarget, targetsOf, type DrawnObstacle, type DrawnRobot, type Target, type Verdict } from "./model";
import type { Drawn } from "./draw";

interface HandArgs extends Omit<Drawn, "doc"> {
  verdict: Verdict | null;
}

/** The item held between a press and its release. */
type Held =
  | { what: "paint"; wall: boolean; regions: Set<number>; last: [number, number] }
  /** `again`: it was chosen before; a click then chooses the next item in its region. */
  | { what: "item"; item: DrawnRobot | DrawnObstacle; from: number; again: boolean }
  | { what: "target"; robot: string; place: number }
  | { what: "heading"; robot: string; at: number; to: string };

export function useDrawingHand(args: HandArgs): Hand {
  const { drawing, pen, setPen, chosen, choose, say, verdict } = args;
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
  const isChosen = (item: DrawnRobot | DrawnObstacle): boolean => keyOf(item) === chosen;
  const picked = drawing.robots.find((robot) => robot.name === chosen);

  // A robot or an obstacle that was just put down is selected as soon as the text has it.
  const awaited = useRef(-1);
  useEffect(() => {
    const put = itemsAt(awaited.current).find((item) => pen.does === ("name" in item ? "robot" : "obstacle"));
    if (put === undefined) return;
    choose(keyOf(put));
    awaited.current = -1;
  }, [drawing]);

  const select = (x: number, y: number, region: number): boolean => {
    if (picked && picked.heading !== null) {
      const [dx, dy] = HEADINGS[picked.heading]!;
      const [col, row] = placeOf(drawing.run, picked.start);
      if (Math.hypot(x - (col + 0.5 + dx * 0.62), y - (row + 0.5 + dy * 0.62)) < 0.2) {
        held.current = { what: "heading", robot: picked.name, at: picked.start, to: picked.heading };
        return true;
      }
    }
    const there = itemsAt(region);
    const again = there.findIndex(isChosen);
    const item = there[Math.max(0, again)];
    if (item) {
      choose(keyOf(item));
      held.current = { what: "item", item, from: region, again: again >= 0 };
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
    if (pen.does === "select") return select(x, y, region);
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
    else if (free(region, "a target")) chooseTarget(pen, region, setPen, say);
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
    } else if (now?.what === "heading") {
      const [col, row] = placeOf(drawing.run, now.at);
      const [dx, dy] = [x - (col + 0.5), y - (row + 0.5)];
      now.to = Math.abs(dx) > Math.abs(dy) ? (dx > 0 ? "east" : "west") : dy > 0 ? "south" : "north";
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
    else if (now.what === "heading") edit("set_heading", { robot: now.robot, heading: now.to });
    else if (region < 0) return;
    else if (now.what === "item" && region !== now.from) {
      if ("name" in now.item) edit("move_robot", { robot: now.item.name, region });
      else edit("move_obstacle", { index: now.item.index, region });
    } else if (now.what === "item" && now.again) {
      const there = itemsAt(region);
      const next = there[(there.findIndex(isChosen) + 1) % there.length];
      if (next) choose(keyOf(next));
    }
    else if (now.what === "target" && picked && picked.kind) {
      const regions = targetsOf(picked).map((target, i) => (i === now.place ? region : target));
      edit("set_objective", { robot: picked.name, kind: picked.kind, regions });
    }
  };

  const square = (region: number, kind: keyof typeof MARKS, key: string) => squareOf(drawing.run, region, kind, key);
  const painting = held.current?.what === "paint" ? held.current : null;
  const firstOf = (target: Target): number => {
    const regions = typeof target === "string" ? (drawing.run.areas[target] ?? [-1]) : [target].flat();
    return regions[0]!;
  };
  const order = pen.does === "objective" ? pen.targets.map(firstOf) : (picked?.targets.map((target) => target[0]!) ?? []);
  const turning = held.current?.what === "heading" ? held.current : null;
  const ahead = HEADINGS[turning ? turning.to : (picked?.heading ?? "")]?.map((way) => way * CELL * 0.62);
  const picture = drawing.obstacles.find(({ index }) => index === chosen);
  const dragged = held.current !== null && held.current.what !== "paint" && held.current.what !== "heading";
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
        {verdict?.confined?.map((region) => square(region, "confined", `c${region}`))}
        {verdict?.lost?.map((region) => square(region, "lost", `l${region}`))}
        {painting &&
          [...painting.regions].map((region) => square(region, painting.wall ? "wall" : "floor", `p${region}`))}
        {picked && square(picked.start, "picked", "picked")}
        {picture && square(picture.region, "picked", "picked")}
        {(order.length > 1 || pen.does === "objective") && ordered(drawing.run, order)}
        {ahead && picked && (
          <g transform={`translate(${centreOf(drawing.run, picked.start).join(" ")})`}>
            <line {...INK.handle} x2={ahead[0]} y2={ahead[1]} />
            <circle {...INK.handle} data-handle={picked.name} cx={ahead[0]} cy={ahead[1]} r={5} />
          </g>
        )}
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
