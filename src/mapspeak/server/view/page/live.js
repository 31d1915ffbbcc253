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

  const events = new EventSource(`${base}/events`);
  const on = (/** @type {string} */ kind, /** @type {(data: any) => void} */ act) =>
    events.addEventListener(kind, (event) => {
      heardAt = performance.now();
      act(JSON.parse(/** @type {MessageEvent} */ (event).data));
    });
  events.onopen = () => { isConnected = true; showState(); };
  events.onerror = () => { isConnected = false; showState(); };
  on("map", (data) => map.showMap(data));
  on("overlay", (data) => map.showOverlay(data));
  on("trail", (data) => map.showTrail(data));
  on("calls", (data) => calls.showAll(data));
  on("call", (data) => calls.show(data));
  on("word", (data) => commands.hear(data));
  on("alive", () => {});
  on("robot", (data) => {
    latest = data;
    map.follow(data);
    commands.showWaiting(data.waiting);
    showState();
  });

  function showState() {
    const silent_s = (performance.now() - heardAt) / 1000;
    const said = [];
    const isLost = !isConnected || silent_s > OLD_S;
    if (isLost) said.push("The server does not answer; trying again.");
    if (latest) {
      const { pose, drive } = latest;
      if (latest.held_by) said.push(`HELD ${latest.held_by}.`);
      if (latest.fault) said.push(latest.fault);
      if (pose) said.push(`x ${pose.x.toFixed(2)}, y ${pose.y.toFixed(2)}, ${pose.yaw_deg.toFixed(0)}°.`);
      if (latest.doubt) said.push(latest.doubt);
      if (drive) said.push(`${drive.id} to ${drive.place}: ${drive.state}. ${drive.reason}`);
      const age_s = latest.age_s + silent_s;
      if (age_s > OLD_S) said.push(`The pose is ${age_s.toFixed(0)} s old.`);
      byId("state").classList.toggle("old", isLost || age_s > OLD_S || Boolean(latest.doubt));
    }
    byId("state").textContent = legible(said.join(" ")) || "Waiting for the robot.";
  }
  setInterval(showState, 1000);

  const camera = new Image();
  camera.id = "camera";
  camera.alt = "What the robot's camera sees now";
  camera.addEventListener("error", () => { camera.alt = "No picture from the robot's camera."; });
  byId("picture").append(camera);
  function lookAhead() {
    if (byId("watching").checked && document.visibilityState === "visible" && isConnected) {
      camera.src = `${base}/camera?at=${Date.now()}`;
    }
  }
  setInterval(lookAhead, 1000);
}

showLive();
