// The live page: hears what happens to one robot, and lets a person command it.
// @ts-check
"use strict";

const OLD_S = 3;

async function showLive() {
  const robots = await (await fetch("robots")).json();
  const wanted = new URLSearchParams(location.search).get("robot");
  const robot = robots.includes(wanted) ? wanted : robots[0];
  const base = `robots/${encodeURIComponent(robot)}`;
  const isFleet = robots.length > 1;
  document.body.classList.toggle("single", !isFleet);
  for (const name of robots) byId("robots").append(new Option(name, name, name === robot, name === robot));
  byId("robots").addEventListener("change", () => {
    location.search = new URLSearchParams({ robot: byId("robots").value }).toString();
  });

  const commands = new Commands(base, { robot, isFleet });
  const map = new MapView(byId("map"), {
    tile: (row, col, name) => `${base}/tiles/${row}/${col}/${name}.png`,
    index: byId("items"),
    onClick: (click) => map.ask(click.at, commands.offer(click, () => map.closeBubble())),
  });
  const calls = new Calls(byId("calls"), { address: (picture) => `${base}/${picture}` });

  /** @type {any} */
  let latest = null;
  let heardAt = 0;
  let isConnected = false;
  let mapAt = 0;

  const events = new EventSource(`${base}/events`);
  const on = (/** @type {string} */ kind, /** @type {(data: any) => void} */ act) =>
    events.addEventListener(kind, (event) => {
      heardAt = performance.now();
      act(JSON.parse(/** @type {MessageEvent} */ (event).data));
    });
  events.onopen = () => { isConnected = true; showState(); };
  events.onerror = () => { isConnected = false; showState(); };
  on("map", (data) => { mapAt = performance.now(); map.showMap(data); });
  on("overlay", (data) => map.showOverlay(data));
  on("trail", (data) => map.showTrail(data));
  on("calls", (data) => calls.showAll(data));
  on("call", (data) => calls.show(data));
  on("missions", (data) => {
    showMissions(byId("missions"), data);
    commands.showQuestions(data.questions);
  });
  on("word", (data) => commands.hear(data));
  on("alive", () => {});
  on("robot", (data) => {
    latest = data;
    map.follow(data);
    commands.showWaiting(data.waiting);
    showCameras(data.cameras);
    showState();
  });

  function showState() {
    const silent_s = (performance.now() - heardAt) / 1000;
    const said = [];
    const isLost = !isConnected || silent_s > OLD_S;
    if (isLost) said.push("The server does not answer; trying again.");
    if (latest) {
      const { pose, drive } = latest;
      document.body.classList.toggle("held", Boolean(latest.held_by));
      if (latest.held_by) said.push(`HELD ${latest.held_by}.`);
      if (latest.fault) said.push(latest.fault);
      if (pose) said.push(`x ${pose.x.toFixed(2)}, y ${pose.y.toFixed(2)}, ${pose.yaw_deg.toFixed(0)}°.`);
      if (latest.doubt) said.push(latest.doubt);
      if (drive) said.push(`${drive.id} to ${drive.place}: ${drive.state}. ${drive.reason}`);
      const age_s = latest.age_s + (isLost ? silent_s : 0);
      said.push(`Pose ${ago(age_s)}, map changed ${mapAt ? ago((performance.now() - mapAt) / 1000) : "never"}.`);
      byId("state").classList.toggle("old", isLost || age_s > OLD_S || Boolean(latest.doubt));
    }
    byId("state").textContent = legible(said.join(" ")) || "Waiting for the robot.";
  }
  setInterval(() => { showState(); calls.showAges(); }, 1000);

  watchCamera(base, () => isConnected);
  watchNavigation(base, map);
}

/** Draw what navigation plans while its layer is on; the next is asked for when the last has come.
 * @param {string} base @param {MapView} map */
function watchNavigation(base, map) {
  let isWaiting = false;
  const note = byId("navigation");
  map.offerNavigation();
  setInterval(async () => {
    note.hidden = !map.showsNavigation;
    if (isWaiting || note.hidden || document.visibilityState !== "visible") return;
    isWaiting = true;
    try {
      const answer = await fetch(`${base}/navigation`);
      const told = answer.ok ? await answer.json() : { said: await answer.text(), parts: [] };
      map.showNavigation(told.parts);
      note.textContent = legible(told.said);
    } catch {
      note.textContent = "The server does not answer.";
    }
    isWaiting = false;
  }, 1000);
}

/** Show the camera: the next picture is asked for when the one before has come.
 * @param {string} base @param {() => boolean} isConnected */
function watchCamera(base, isConnected) {
  const camera = new Image();
  camera.id = "camera";
  camera.hidden = true;
  camera.alt = "What the robot's camera sees now";
  byId("picture").append(camera);
  let seenAt = 0;
  let isWaiting = false;
  async function look() {
    if (!isWaiting && byId("watching").checked && document.visibilityState === "visible" && isConnected()) {
      isWaiting = true;
      const next = new Image();
      const asked = new URLSearchParams({ at: String(Date.now()) });
      if (byId("cameras").selectedIndex > 0) asked.set("camera", byId("cameras").value);
      next.src = `${base}/camera?${asked}`;
      try {
        await next.decode();
        camera.src = next.src;
        camera.hidden = false;
        seenAt = performance.now();
      } catch { /* the age below tells */ }
      isWaiting = false;
    }
    const age_s = (performance.now() - seenAt) / 1000;
    byId("seen").textContent = seenAt ? (age_s > OLD_S ? ` Picture ${ago(age_s)}.` : "") : " No picture from the robot's camera.";
    byId("picture").classList.toggle("old", age_s > OLD_S);
  }
  look();
  setInterval(look, 1000);
}

/** Let a person choose among several cameras. @param {string[]} names */
function showCameras(names) {
  const choice = byId("cameras");
  if (names.join() === Array.from(choice.options, (each) => each.value).join()) return;
  const chosen = choice.value;
  choice.replaceChildren(...names.map((name) => new Option(legible(name), name, false, name === chosen)));
  choice.hidden = names.length < 2;
}

const SIGNS = { running: "▶", succeeded: "✓", failed: "✗", cancelled: "■", timed_out: "✗" };

/** Draw the latest mission with the state of each leaf, and the saved ones.
 * @param {HTMLElement} list @param {any} told */
function showMissions(list, { latest, is_over: isOver, states, saved }) {
  const tree = (/** @type {any} */ step, /** @type {Record<string, string>} */ known) => {
    const row = document.createElement("li");
    const state = known[step.number];
    row.className = state ?? "";
    row.append(plain(`${SIGNS[/** @type {keyof typeof SIGNS} */ (state)] ?? "·"} ${step.said}`));
    if (state) row.append(` ${state.replace("_", " ")}`);
    if (step.steps.length) {
      const inner = document.createElement("ul");
      inner.append(...step.steps.map((/** @type {any} */ each) => tree(each, known)));
      row.append(inner);
    }
    return row;
  };
  const part = (/** @type {any} */ plan, /** @type {string} */ title, /** @type {boolean} */ isOpen, known = {}) => {
    const [details, summary, steps] = ["details", "summary", "ul"].map((name) => document.createElement(name));
    /** @type {HTMLDetailsElement} */ (details).open = isOpen;
    summary.append(plain(title));
    steps.append(tree(plan.tree, known));
    details.append(summary, ...plan.remember.map((/** @type {string} */ said) => plain(`Remember: ${said}`)), steps);
    return details;
  };
  const running = latest ? [part(latest, `${isOver ? "Last mission" : "Mission under way"}: ${latest.name}`, true, states)] : [];
  list.replaceChildren(...running,
    ...saved.map((/** @type {any} */ plan) => part(plan, `Saved mission: ${plan.name}`, false)));
  list.hidden = !list.childElementCount;
}

showLive();
