// A replay: what was said and seen step by step, with the robot where it then stood.
// @ts-check
"use strict";

/**
 * @typedef {{call: Call, at_s: number, pose: {x: number, y: number, yaw_deg: number} | null,
 *   goal: {x: number, y: number, yaw_deg: number} | null, robot: string, trail: [number, number], n_moments: number}} Step
 */

const LONGEST_S = 4;
const SHORTEST_S = 0.15;

/** Return the parts of an overlay that a moment changes, as they are then.
 * @param {any} before @param {Record<string, {names: string[], items: any[]}>} changes */
function change(before, changes) {
  const name = (/** @type {any} */ item) => item.id ?? item.title;
  return Object.fromEntries(Object.entries(changes).map(([part, { names, items }]) => {
    const known = new Map([...before[part], ...items].map((item) => [name(item), item]));
    return [part, names.map((each) => known.get(each)).filter(Boolean)];
  }));
}

class Replay {
  /** @param {any} told the document */
  constructor(told) {
    /** @type {Step[]} */
    this.steps = told.steps;
    this.trail = told.trail;
    this.now = 0;
    this.timer = 0;
    this.map = new MapView(byId("map"), { index: byId("items") });
    this.calls = new Calls(byId("calls"), { isNewestFirst: false, most: Infinity });
    this.describe(told);
    this.pictures = told.map?.pictures ?? {};
    this.nothing = told.map && { ...told.map, tiles: [] };
    /** The map and all on it after each moment. @type {{map: any, overlay: any}[]} */
    this.moments = [{ map: this.nothing, overlay: told.overlay }];
    for (const { map, overlay } of told.moments) {
      const before = this.moments[this.moments.length - 1];
      this.moments.push({ map: map ?? before.map, overlay: { ...before.overlay, ...change(before.overlay, overlay) } });
    }
    this.shown = -1;
    if (told.map) this.map.showMap(told.map);
    else this.map.fit([...this.trail, ...this.steps.flatMap(({ goal }) => (goal ? [[goal.x, goal.y]] : []))]);
    this.map.showOverlay(told.overlay);
    this.calls.showAll(this.steps.map((step) => step.call));
    this.calls.rows.forEach((row, number) => { row.id = `step-${number}`; });
    this.listen();
    this.follow();
  }

  /** @param {any} told */
  describe(told) {
    for (const [name, said] of told.about) {
      const [term, what] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = name;
      what.append(plain(said));
      byId("about").append(term, what);
    }
    byId("heading").textContent = "Steps";
    const back = /** @type {HTMLAnchorElement} */ (byId("back"));
    back.hidden = !told.back;
    back.href = told.back;
  }

  listen() {
    byId("slider").max = String(Math.max(0, this.steps.length - 1));
    byId("slider").addEventListener("input", () => { this.pause(); this.show(Number(byId("slider").value)); });
    byId("step-back").addEventListener("click", () => { this.pause(); this.show(this.now - 1); });
    byId("step-on").addEventListener("click", () => { this.pause(); this.show(this.now + 1); });
    byId("play").addEventListener("click", () => (this.timer ? this.pause() : this.play()));
    window.addEventListener("hashchange", () => this.follow());
    this.calls.rows.forEach((row, number) => row.querySelector("summary")?.addEventListener("click", (event) => {
      if (number - 1 === this.now) return;
      event.preventDefault();
      this.pause();
      this.show(number - 1);
    }));
    document.addEventListener("keydown", (event) => {
      const at = /** @type {HTMLElement} */ (event.target);
      if (at.closest("input, select, pre, #map")) return;
      if (event.key === " " && !at.closest("button, summary, a")) byId("play").click();
      else if (event.key === "ArrowLeft") byId("step-back").click();
      else if (event.key === "ArrowRight") byId("step-on").click();
      else return;
      event.preventDefault();
    });
  }

  follow() {
    const wanted = Number(location.hash.match(/^#step-(\d+)$/)?.[1] ?? this.now + 1);
    this.show(wanted - 1);
  }

  /** @param {number} index */
  show(index) {
    if (!this.steps.length) { byId("state").textContent = "Nothing was said."; return; }
    this.row(this.now)?.classList.remove("now");
    this.now = Math.max(0, Math.min(this.steps.length - 1, index));
    const step = this.steps[this.now];
    this.calls.rows.forEach((row, number) => {
      const details = /** @type {HTMLDetailsElement} */ (row.firstChild);
      if (details.open !== (number - 1 === this.now)) details.open = number - 1 === this.now;
    });
    const row = this.row(this.now);
    row?.classList.add("now");
    row?.scrollIntoView({ block: "nearest" });
    byId("slider").value = String(this.now);
    byId("step").textContent = `${this.now + 1} of ${this.steps.length}`;
    const { pose, robot } = step;
    const stood = pose ? ` at x ${pose.x.toFixed(2)}, y ${pose.y.toFixed(2)}, ${pose.yaw_deg.toFixed(0)}°` : "";
    byId("state").textContent = `${robot && `${legible(robot)}: `}${step.at_s.toFixed(1)} s${stood}`;
    this.showMoment(step.n_moments);
    this.map.showTrail(this.trail.slice(...step.trail));
    const last = this.latest((each) => each.pose)?.pose;
    if (!last) this.map.layers.robot.clearLayers();
    this.map.showRobot({ pose: last, goal: step.goal });
    this.showSeen();
  }

  /** Show the map as it then was, where that is known. @param {number} index */
  showMoment(index) {
    if (this.moments.length === 1 || index === this.shown) return;
    const [before, { map, overlay }] = [this.moments[this.shown], this.moments[index]];
    if (map !== before?.map) this.map.showMap({ ...map, pictures: this.pictures });
    this.map.showOverlay(overlay);
    this.shown = index;
  }

  /** Return the latest step by now of the same robot that has something. @param {(step: Step) => any} has */
  latest(has) {
    const { robot } = this.steps[this.now];
    return this.steps.slice(0, this.now + 1).reverse().find((step) => step.robot === robot && has(step));
  }

  /** Show the picture that was seen last. */
  showSeen() {
    const seen = this.latest((step) => step.call.pictures.length);
    const name = seen?.call.pictures.at(-1);
    const said = seen ? `seen in step ${seen.call.number}` : "nothing seen yet";
    byId("seen").textContent = said;
    if (name === this.seen) return;
    this.seen = name;
    byId("picture").replaceChildren(...(name ? [showPicture(name, `What was ${said}`)] : []));
  }

  /** @param {number} index */
  row(index) {
    return this.calls.rows.get(index + 1);
  }

  play() {
    if (this.now === this.steps.length - 1) this.show(0);
    byId("play").textContent = "Pause";
    this.wait();
  }

  /** Go on when the next step is due; nobody waits through a long drive, nor misses a quick step. */
  wait() {
    const [here, next] = [this.steps[this.now], this.steps[this.now + 1]];
    if (!next) { this.pause(); return; }
    const real_s = (next.at_s - here.at_s) / Number(byId("speed").value);
    const wait_s = Math.min(LONGEST_S, Math.max(SHORTEST_S, real_s));
    this.timer = window.setTimeout(() => { this.show(this.now + 1); this.wait(); }, 1000 * wait_s);
  }

  pause() {
    window.clearTimeout(this.timer);
    this.timer = 0;
    byId("play").textContent = "Play";
  }
}

new Replay(JSON.parse(byId("document").textContent));
